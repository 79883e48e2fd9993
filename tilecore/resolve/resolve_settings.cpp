#include "tilecore/resolve/resolve_settings.h"

#include <string>

#include "base/error.h"

namespace tessera::tilecore {
namespace {

Keys<ResolveSettings> rate_keys() {
  Keys<ResolveSettings> keys;
  keys.add(Keys<ResolveSettings>{
      {"resolve.desampling", &ResolveSettings::desampling,
       "Choice of the shaded pixels: all; by motion, edges and history; half or a quarter of every block; half, "
       "alternating, filled from four neighbours. The others are advected or reconstructed."},
  });
  keys.add(&ResolveSettings::rates,
           Keys<RateSettings>().add(
               &RateSettings::thresholds,
               Keys<SpeedThresholds>{
                   {"resolve.reuse_speed", &SpeedThresholds::reuse, "pixels/frame", 0, 64,
                    "Blocks slower than this take pixels from the previous frame (resolve.advected_pixels)."},
                   {"resolve.half_rate_speed", &SpeedThresholds::half_rate, "pixels/frame", 0, 1e6,
                    "Blocks faster than this are shaded at 8 of 16 pixels."},
                   {"resolve.quarter_rate_speed", &SpeedThresholds::quarter_rate, "pixels/frame", 0, 1e6,
                    "Blocks faster than this are shaded at 4 of 16 pixels."},
                   {"resolve.cut_speed", &SpeedThresholds::cut, "pixels/frame", 0, 1e6,
                    "A change of the camera's motion from one frame to the next by more than this is a cut: no block "
                    "then counts as fast. 0: no change is a cut."},
                   {"resolve.hysteresis", &SpeedThresholds::hysteresis, "", 0, 0.5,
                    "Share of a threshold by which a speed must pass it before a block changes its regime."},
               }));
  keys.add(&ResolveSettings::rates,
           Keys<RateSettings>{
               {"resolve.pattern_error", &RateSettings::pattern_error, "", 0, 1,
                "A fast block is shaded at a higher rate if the contrast of the previous frame in its place predicts "
                "an error of stencils of more than this, of displayed values between 0 and 1; 0: never."},
           });
  keys.add(Keys<ResolveSettings>{
      {"resolve.block_speed", &ResolveSettings::block_speed,
       "Statistic of its pixels' speeds that a block goes by; max does not overlook a small fast object."},
  });
  keys.add(&ResolveSettings::edges,
           Keys<EdgeSettings>{
               {"resolve.edges", &EdgeSettings::measure,
                "Quantity of which the edge detector takes the Laplacian; the Laplacian of 1/z is zero on any plane."},
               {"resolve.edge_threshold", &EdgeSettings::threshold, "", 0, 10,
                "A pixel whose Laplacian is larger than this share of the value is an edge."},
           });
  keys.add(Keys<ResolveSettings>{
      {"resolve.edge_angle", &ResolveSettings::edge_angle, "degrees", 0, 180,
       "Normals in a block, which follow from depth, also make an edge if they differ by more than this; 0: never."},
  });
  keys.add(&ResolveSettings::rates,
           Keys<RateSettings>{
               {"resolve.supersampling", &RateSettings::supersampling,
                "Blocks with an edge are shaded at 32 instead of 16: the left and the right half of a pixel's samples "
                "do not "
                "share pixel-shader invocations (shading.rate=pixel)."},
               {"resolve.advected_pixels", &RateSettings::advected, "of 16 pixels", 8, 12,
                "Number of pixels of a slow block that come from the previous frame, 8 or 12; the others are shaded. "
                "Always 8 if several surfaces meet."},
           });
  return keys;
}

Keys<ResolveSettings> pixel_keys() {
  Keys<ResolveSettings> keys;
  keys.add(&ResolveSettings::dither,
           Keys<DitherSettings>{
               {"resolve.dither", &DitherSettings::order,
                "Change of a block's pattern from frame to frame: in turn, by a hash, not at all."},
           });
  keys.add(Keys<ResolveSettings>{
      {"resolve.advection", &ResolveSettings::advect, "Slow blocks take pixels from the previous frame."},
  });
  keys.add(&ResolveSettings::advection,
           Keys<AdvectionSettings>{
               {"resolve.advection_fetch", &AdvectionSettings::fetch,
                "Interpolation of the previous frame between its pixels."},
               {"resolve.bfecc", &AdvectionSettings::bfecc, "Back and forth error compensation of advection."},
           });
  keys.add(&ResolveSettings::discrepancy,
           Keys<DiscrepancySettings>{
               {"resolve.discrepancy", &DiscrepancySettings::check,
                "Test whether reprojection went wrong in a block: it compares rendered pixels with their reprojected "
                "colours. If they differ the block's reprojected pixels are shaded after all, and blocks around it "
                "reuse no pixels in the next frames."},
               {"resolve.discrepancy_tolerance", &DiscrepancySettings::tolerance, "", 0, 1,
                "A pixel that differs by more than this share was reprojected wrongly."},
               {"resolve.discrepancy_frames", &DiscrepancySettings::frames, "frames", 1, 15,
                "Number of frames for which the blocks around a wrongly reprojected one are shaded fully."},
           });
  keys.add(Keys<ResolveSettings>{
      {"resolve.reconstruction", &ResolveSettings::reconstruction,
       "Reconstruction of missing pixels from rendered ones: cubic stencils of 5x5 scaled to the samples, of 7x7 "
       "interpolating, unscaled; a tent; the nearest."},
      {"resolve.history_colors", &ResolveSettings::colors,
       "Source of the previous frame's colours: the frame buffer, or a separate copy as shaded, in single precision, "
       "16 bytes a pixel."},
      {"resolve.stencil_reach", &ResolveSettings::reach,
       "Whether stencils stop at the tile's border, or read neighbouring tiles in a second pass."},
  });
  keys.add(
      &ResolveSettings::foveation,
      Keys<FoveationSettings>{
          {"resolve.foveation_r0", &FoveationSettings::r0, "pixels", 0, 1e6,
           "Foveation: blocks farther than this from the focus get at most 8 samples; 0 is off."},
          {"resolve.foveation_r1", &FoveationSettings::r1, "pixels", 0, 1e6,
           "Foveation: blocks farther than this get at most 4; at least foveation_r0."},
          {"resolve.focus_x", &FoveationSettings::focus_x, "frame widths", 0, 1, "Focus of the gaze, from the left."},
          {"resolve.focus_y", &FoveationSettings::focus_y, "frame heights", 0, 1, "Focus of the gaze, from the top."},
          {"resolve.focus_node", &FoveationSettings::focus_node,
           "Name of a node that the focus follows: its origin in the middle of the shutter; focus_x and focus_y if "
           "that is behind the camera."},
      });
  return keys;
}

void check_focus(const ResolveSettings& settings) {
  if (settings.foveation.focus_node.empty()) return;
  if (!settings.foveation.on() || settings.desampling != Desampling::kAdaptive)
    throw UsageError(
        "resolve.focus_node steers foveation, which is off: set resolve.desampling=adaptive and resolve.foveation_r0");
}

}  // namespace

Keys<ResolveSettings> resolve_keys() { return rate_keys().add(pixel_keys()); }

void check_resolve(const ResolveSettings& settings) {
  const SpeedThresholds& speeds = settings.rates.thresholds;
  if (speeds.reuse > speeds.half_rate || speeds.half_rate > speeds.quarter_rate)
    throw UsageError(
        "resolve.reuse_speed, resolve.half_rate_speed and resolve.quarter_rate_speed must not fall in this order");
  if (settings.foveation.on() && settings.foveation.r1 < settings.foveation.r0)
    throw UsageError("resolve.foveation_r1 must be at least resolve.foveation_r0");
  if (settings.rates.advected % 4 != 0) throw UsageError("resolve.advected_pixels must be 8 or 12");
  check_focus(settings);
}

}  // namespace tessera::tilecore
