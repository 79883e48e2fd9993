/* The one place where stb's code is compiled. */
#include "base/stb_bridge.h"

#include <stdlib.h>

#define STBI_WRITE_NO_STDIO
#define STB_IMAGE_WRITE_STATIC
#define STB_IMAGE_WRITE_IMPLEMENTATION
#include <stb_image_write.h>

#define STBI_NO_STDIO
#define STBI_ONLY_PNG
#define STBI_MAX_DIMENSIONS 65536
#define STB_IMAGE_STATIC
#define STB_IMAGE_IMPLEMENTATION
#include <stb_image.h>

int tessera_stb_info(const unsigned char* bytes, int size, int* width, int* height, int* channels) {
  return stbi_info_from_memory(bytes, size, width, height, channels);
}
int tessera_stb_is_16_bit(const unsigned char* bytes, int size) { return stbi_is_16_bit_from_memory(bytes, size); }
unsigned char* tessera_stb_load(const unsigned char* bytes, int size, int* width, int* height, int* channels) {
  return stbi_load_from_memory(bytes, size, width, height, channels, 0);
}
unsigned short* tessera_stb_load_16(const unsigned char* bytes, int size, int* width, int* height, int* channels) {
  return stbi_load_16_from_memory(bytes, size, width, height, channels, 0);
}
void tessera_stb_free(void* pixels) { stbi_image_free(pixels); }
const char* tessera_stb_failure_reason(void) { return stbi_failure_reason(); }

int tessera_stb_write_jpeg(tessera_stb_append append, void* context, int width, int height, int channels,
                           const void* pixels, int quality) {
  return stbi_write_jpg_to_func(append, context, width, height, channels, pixels, quality);
}
