#pragma once

#include <stddef.h>

// stb behind names of our own: Debian's Draco library exports a copy of stb (and of tinygltf) under stb's names, and
// the linker would be free to take that one.
#ifdef __cplusplus
extern "C" {
#endif

// As stbi_info_from_memory, stbi_is_16_bit_from_memory, stbi_load_from_memory (as many channels as the file has),
// stbi_load_16_from_memory, stbi_image_free, stbi_failure_reason.
int tessera_stb_info(const unsigned char* bytes, int size, int* width, int* height, int* channels);
int tessera_stb_is_16_bit(const unsigned char* bytes, int size);
unsigned char* tessera_stb_load(const unsigned char* bytes, int size, int* width, int* height, int* channels);
unsigned short* tessera_stb_load_16(const unsigned char* bytes, int size, int* width, int* height, int* channels);
void tessera_stb_free(void* pixels);
const char* tessera_stb_failure_reason(void);

// Hand the packed bytes to `append` in pieces; 0 when memory runs out.
typedef void (*tessera_stb_append)(void* context, void* data, int size);
int tessera_stb_write_jpeg(tessera_stb_append append, void* context, int width, int height, int channels,
                           const void* pixels, int quality);

#ifdef __cplusplus
}
#endif
