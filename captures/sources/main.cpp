#include <cstdio>
#include <exception>

#include "captures/sources/scenes.h"

// tessera_make_captures FOLDER: writes the sources of all shipped captures into FOLDER.
int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: tessera_make_captures FOLDER\n");
    return 2;
  }
  try {
    tessera::captures::make_eggs(argv[1]);
    tessera::captures::make_vases(argv[1]);
    tessera::captures::make_serpent(argv[1]);
    tessera::captures::make_flyby(argv[1]);
    tessera::captures::make_stroll(argv[1]);
    tessera::captures::make_workshop(argv[1]);
    tessera::captures::make_city(argv[1]);
    tessera::captures::make_garden(argv[1]);
    tessera::captures::make_city_evening(argv[1]);
    tessera::captures::make_garden_lamps(argv[1]);
    tessera::captures::make_corridor(argv[1]);
    for (const int layers : {1, 4, 16}) tessera::captures::make_wall(argv[1], layers, true);
    tessera::captures::make_wall(argv[1], 4, false);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "tessera_make_captures: %s\n", error.what());
    return 1;
  }
  return 0;
}
