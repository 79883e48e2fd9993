// The one place where tinygltf is compiled: structure only (see CMakeLists.txt), without its own reading of files and
// images.
#include <fstream>  // tinygltf forgets it without its file callbacks

#define TINYGLTF_IMPLEMENTATION
#include <tiny_gltf.h>
