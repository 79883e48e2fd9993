#pragma once

#include "captures/sources/asset.h"

namespace tessera::captures {

// Adds spot lights in tin shades of one shape; each is a light of its own.
class Lanterns {
 public:
  explicit Lanterns(Asset& asset);

  struct Beam {
    float candela;
    float inner, outer;  // half angles in degrees
  };

  // Adds a lantern on a post `height` metres high at `foot`, with its arm and its beam towards `target`.
  int add_on_post(Vec3 foot, float height, Vec3 target, const Beam& beam);
  // Adds a lantern on a cord at `hook` that swings in the wind: the node's rotation has keys at `times`.
  int add_on_cord(Vec3 hook, float length, const Beam& beam, const std::vector<float>& times, float phase);
  // Adds a bare light near the ground that shines up at `target`.
  int add_from_below(Vec3 at, Vec3 target, const Beam& beam);

 private:
  int add_spot(const Beam& beam);
  // Returns the node of a light that looks at `target`; a lantern, or a dish that is turned up, hangs from it.
  int add_shining(Vec3 at, Vec3 target, int light, bool up);

  Asset& asset_;
  int lantern_, dish_, post_, cord_;
};

}  // namespace tessera::captures
