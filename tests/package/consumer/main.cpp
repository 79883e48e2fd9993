// Prints the counters of the first frame of a capture.
#include <tessera/tessera.h>

#include <iostream>

int main(int argc, char** argv) try {
  const tessera::Scene scene(argc > 1 ? argv[1] : "captures/eggs.glb");
  tessera::Gpu gpu("small");
  gpu.set("tile.width", 32);
  tessera::Settings settings;
  settings.set("shading.rate", "sample");
  tessera::RenderOptions options;
  options.width = 160;
  options.height = 90;
  tessera::Device device(scene, gpu, settings, options);
  const tessera::Frame frame = device.render(scene.first_frame());
  for (const auto& [name, value] : frame.counters()) std::cout << name << ' ' << value << '\n';
} catch (const tessera::Error& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
