#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace tessera::scene {

// TESSERA_capture.attachments and .passes: a frame as a graph of passes, as its file describes it. Plain data; attachments
// are referred to by name. Attachments `frame` and `depth` always exist: they have the size and the samples of the frame,
// and the machine gives them a format.

inline constexpr std::string_view kFrameAttachment = "frame", kDepthAttachment = "depth";

enum class AttachmentFormat : std::uint8_t { kRgba8, kRgb10A2, kRgba16F, kR11G11B10F, kRg16F, kD16, kD24, kD32F };
inline constexpr std::array<std::string_view, 8> kAttachmentFormatNames = {"rgba8", "rgb10a2", "rgba16f", "r11g11b10f",
                                                                           "rg16f", "d16",     "d24",     "d32f"};
inline bool is_depth(AttachmentFormat format) { return format >= AttachmentFormat::kD16; }
// Bits of a sample in memory; a depth of 24 bits takes 32.
inline int sample_bits(AttachmentFormat format) {
  return format == AttachmentFormat::kRgba16F ? 64 : format == AttachmentFormat::kD16 ? 16 : 32;
}

enum class AttachmentLife : std::uint8_t {
  kTransient,  // exists in tile memory during one pass
  kFrame,      // exists in memory during one frame
  kPersistent  // a pass that samples it before this frame has written it finds the contents of the previous frame
};
inline constexpr std::array<std::string_view, 3> kAttachmentLifeNames = {"transient", "frame", "persistent"};

struct Attachment {
  static constexpr int kMaxSize = 16384, kMaxSamples = 16, kMaxLayers = 256, kMaxLevels = 15;

  std::string name;
  AttachmentFormat format = AttachmentFormat::kRgba8;
  std::optional<std::array<int, 2>> size;  // width and height in pixels; unset: `scale` times the frame's
  double scale = 1;                        // (0, 16]
  int samples = 0;                         // samples of a pixel, a power of two; 0: as many as the frame has
  int layers = 1, levels = 1;
  AttachmentLife life = AttachmentLife::kFrame;
};

// The patches that a subpass draws. A subpass that draws nothing runs its shader at every pixel of the image.
enum class DrawFilter : std::uint8_t { kNothing, kOpaque, kBlended, kAll };
inline constexpr std::array<std::string_view, 4> kDrawFilterNames = {"nothing", "opaque", "blended", "all"};

enum class PassShader : std::uint8_t {
  kDepth,    // draws, and writes depth only
  kForward,  // draws shaded surfaces
  kGbuffer,  // draws the parameters of surfaces
  kLight,    // shades the surfaces that kGbuffer stored
  kReduce,   // makes levels
  kBloom,
  kTonemap,
  kTaa,  // temporal antialiasing
  kCopy
};
inline constexpr std::array<std::string_view, 9> kPassShaderNames = {"depth", "forward", "gbuffer", "light", "reduce",
                                                                     "bloom", "tonemap", "taa",     "copy"};
inline bool is_drawing(PassShader shader) { return shader <= PassShader::kGbuffer; }

// Draws patches, or runs a shader over the image in tile memory. It reads `input` from there, at its own pixel, as
// earlier subpasses of the same pass left it; `sample` are textures that other passes have stored.
struct Subpass {
  DrawFilter draw = DrawFilter::kNothing;
  PassShader shader = PassShader::kForward;
  std::vector<std::string> input, write, sample;
};

enum class PassView : std::uint8_t { kCamera, kRight };  // the capture's camera; its right eye
inline constexpr std::array<std::string_view, 2> kPassViewNames = {"camera", "right"};
enum class LoadAction : std::uint8_t { kClear, kLoad, kNone };
inline constexpr std::array<std::string_view, 3> kLoadActionNames = {"clear", "load", "none"};
enum class StoreAction : std::uint8_t { kStore, kResolve, kDiscard };
inline constexpr std::array<std::string_view, 3> kStoreActionNames = {"store", "resolve", "discard"};

struct Pass {
  static constexpr std::size_t kMaxSubpasses = 4, kMaxColors = 8;

  std::string name;
  PassView view = PassView::kCamera;
  std::vector<Subpass> subpasses;  // at least one
  bool lists_subpasses = false;    // false: the file gives the fields of the only subpass in the pass itself
  // Overrides of the actions that follow from the graph, by attachment.
  std::vector<std::pair<std::string, LoadAction>> load;
  std::vector<std::pair<std::string, StoreAction>> store;
};

struct PassGraph {
  static constexpr std::size_t kMaxAttachments = 64, kMaxPasses = 64;

  std::vector<Attachment> attachments;  // without `frame` and `depth`
  std::vector<Pass> passes;             // at least one

  // Returns nullptr for `frame`, `depth` and names that the graph does not have.
  const Attachment* find(std::string_view name) const;
};

// Whether temporal antialiasing samples an attachment as velocities: one of rg16f.
bool is_velocity(const PassGraph& graph, std::string_view name);

// The attachment in which a pass keeps its depth: one of a depth format that it writes, else `depth` where it draws.
// Empty where the pass has no depth. The graph has passed find_fault().
std::string_view depth_attachment(const PassGraph& graph, const Pass& pass);

// The first fault of a graph, and its JSON pointer below TESSERA_capture.
struct GraphFault {
  std::string pointer, text;
};

// Returns nothing where a machine with enough tile memory could render the graph.
//
// Invariants (cited by the tests):
//   RG1  Names: attachments that are referred to exist, no attachment is called `frame` or `depth`, passes and attachments
//        have names of their own, and every name in `load` and `store` belongs to an attachment that the pass writes.
//   RG2  Attachments that one pass writes have one size, one number of layers and one number of samples. They are at most
//        8 colours and one depth. A pass that draws writes `depth`, unless it writes another attachment of a depth format.
//   RG3  An input was written by an earlier subpass of the same pass.
//   RG4  A pass samples nothing that it writes, except a persistent attachment, of which it finds the contents of the
//        previous frame. Transient attachments are neither sampled nor loaded nor stored.
//   RG5  Some pass writes each sampled attachment, and some pass writes `frame`. No pass discards an attachment that
//        another one samples from it, and the last pass that writes `frame` stores it.
//   RG6  Passes have an order: see pass_order().
//   RG7  A shader has its operands: `depth`, `forward` and `gbuffer` draw, others do not; `depth` writes no colours,
//        others write something; `light`, `tonemap` and `copy` read an input or a sample, `reduce`, `bloom` and `taa` a
//        sample; one sample of `taa` is persistent. A pass of the right eye draws.
std::optional<GraphFault> find_fault(const PassGraph& graph);

// Passes in the order in which they run, as indices. A pass that samples an attachment runs after the last writer of
// the attachment that is listed before it, and before the next writer. Without a writer before it, it runs after the
// first writer listed after it, unless the attachment is persistent. Passes that write one attachment run in the order
// of the list, and so do passes without a dependency between them. Empty where the dependencies form a cycle.
std::vector<int> pass_order(const PassGraph& graph);

// Bytes of tile memory per sample of a pass: 4 for depth plus the bytes of its colours. Colours take at least 16 bytes,
// because they share their place with the visibility record. A pass that draws nothing has its colours alone.
// `frame_bits`: bits of a sample of `frame`. The graph has passed find_fault().
int tile_bytes_per_sample(const PassGraph& graph, const Pass& pass, int frame_bits = 32);

}  // namespace tessera::scene
