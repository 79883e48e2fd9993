// Draco streams as Draco's own decoder reads them.
#include <draco/compression/decode.h>

#include "replay/pack/draco_encoder.h"
#include "tests/support/tests.h"

namespace tessera::replay::draco_encoder_test {
namespace {

constexpr int kUnsignedByte = 5121, kShort = 5122, kUnsignedShort = 5123;

std::unique_ptr<draco::Mesh> decode(const DracoOutput& output) {
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char*>(output.bytes.data()), output.bytes.size());
  draco::Decoder decoder;
  return std::move(decoder.DecodeMeshFromBuffer(&buffer)).value();
}

std::vector<std::uint32_t> indices_of(const draco::Mesh& mesh) {
  std::vector<std::uint32_t> indices;
  for (std::uint32_t f = 0; f < mesh.num_faces(); ++f)
    for (const draco::PointIndex& corner : mesh.face(draco::FaceIndex(f))) indices.push_back(corner.value());
  return indices;
}

// Scalars of an attribute, per point; integers as they are stored.
std::vector<float> values_of(const draco::Mesh& mesh, int unique_id) {
  const draco::PointAttribute& attribute = *mesh.GetAttributeByUniqueId(static_cast<std::uint32_t>(unique_id));
  const auto n = static_cast<std::size_t>(attribute.num_components());
  std::vector<float> values(mesh.num_points() * n);
  for (std::uint32_t p = 0; p < mesh.num_points(); ++p) {
    const draco::AttributeValueIndex index = attribute.mapped_index(draco::PointIndex(p));
    if (attribute.data_type() == draco::DT_FLOAT32) {
      EXPECT_TRUE(attribute.ConvertValue<float>(index, static_cast<std::int8_t>(n), &values[p * n]));
    } else {
      std::array<std::int32_t, 4> integers{};
      EXPECT_TRUE(attribute.ConvertValue<std::int32_t>(index, static_cast<std::int8_t>(n), integers.data()));
      std::copy_n(integers.begin(), n, &values[p * n]);
    }
  }
  return values;
}

// Triangles over random points: shared corners, no two alike.
DracoInput random_mesh(Random& random, std::size_t vertices, std::size_t triangles) {
  DracoInput input;
  input.vertex_count = vertices;
  DracoAttribute position{"POSITION", 3, 5126, false, {}};
  for (std::size_t i = 0; i < 3 * vertices; ++i) position.values.push_back(random.uniform(-5.0f, 7.0f));
  input.attributes = {position};
  const auto corner = [&] { return static_cast<std::uint32_t>(random.integer(0, static_cast<int>(vertices) - 1)); };
  while (input.indices.size() < 3 * triangles) {
    const std::uint32_t a = corner(), b = corner(), c = corner();
    if (a != b && b != c && a != c) input.indices.insert(input.indices.end(), {a, b, c});
  }
  return input;
}

float range_of(const std::vector<float>& values, std::size_t components) {
  float range = 0;
  for (std::size_t c = 0; c < components; ++c) {
    float low = values[c], high = values[c];
    for (std::size_t i = c; i < values.size(); i += components)
      low = std::min(low, values[i]), high = std::max(high, values[i]);
    range = std::max(range, high - low);
  }
  return range;
}

float largest_difference(const std::vector<float>& a, const std::vector<float>& b) {
  float largest = a.size() == b.size() ? 0.0f : INFINITY;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) largest = std::max(largest, std::abs(a[i] - b[i]));
  return largest;
}

TEST(DracoEncoder, SequentialOrderKeepsIndicesExactlyAndPositionsWithinHalfAStep) {
  Random random(1);
  for (const int bits : {1, 8, 11, 16, 20, kMaxBits}) {
    const DracoInput input = random_mesh(random, 300, 500);
    QuantizationBits quantization;
    quantization.position = bits;
    const DracoOutput output = encode_draco(input, quantization, true);
    const auto mesh = decode(output);
    EXPECT_EQ(indices_of(*mesh), input.indices);
    // A step is the largest extent divided by 2^bits - 1; rounding in float adds a little, and is all that is left at
    // 24.
    const float step = range_of(input.attributes[0].values, 3) / (std::exp2(static_cast<float>(bits)) - 1.0f);
    const float error = largest_difference(values_of(*mesh, output.unique_ids[0]), input.attributes[0].values);
    EXPECT_LE(error, 0.5f * step + 2e-6f) << bits;
    // The bound is tight: half as much is not kept.
    if (bits <= 20) {
      EXPECT_GT(error, 0.25f * step) << bits;
    }
  }
}

TEST(DracoEncoder, AttributesThatAreTheSameEverywhereComeBackExactly) {
  Random random(4);
  for (const bool sequential : {false, true}) {
    DracoInput input = random_mesh(random, 60, 80);
    for (std::size_t i = 2; i < input.attributes[0].values.size(); i += 3)
      input.attributes[0].values[i] = -1234.5f;  // a plane
    DracoAttribute texcoord{"TEXCOORD_0", 2, 5126, false, std::vector<float>(2 * input.vertex_count, 0.375f)};
    input.attributes.push_back(texcoord);
    const DracoOutput output = encode_draco(input, {}, sequential);
    const auto mesh = decode(output);
    for (const float v : values_of(*mesh, output.unique_ids[1])) EXPECT_EQ(v, 0.375f);
    const std::vector<float> positions = values_of(*mesh, output.unique_ids[0]);
    for (std::size_t i = 2; i < positions.size(); i += 3) EXPECT_EQ(positions[i], -1234.5f);
  }
}

TEST(DracoEncoder, DegenerateTrianglesAndUnusedVerticesStayInSequentialOrder) {
  Random random(2);
  DracoInput input = random_mesh(random, 40, 30);
  input.indices.insert(input.indices.end(), {3, 3, 3, 1, 2, 1, 0, 1, 2, 0, 1, 2});
  const DracoOutput output = encode_draco(input, {}, true);
  const auto mesh = decode(output);
  EXPECT_EQ(indices_of(*mesh), input.indices);
  EXPECT_EQ(mesh->num_points(), input.vertex_count);
}

TEST(DracoEncoder, IntegersComeBackExactlyInEitherOrder) {
  Random random(3);
  DracoInput input = random_mesh(random, 200, 300);
  const auto add = [&](const char* name, int components, int type, bool normalized, int low, int high) {
    DracoAttribute attribute{name, components, type, normalized, {}};
    for (std::size_t i = 0; i < static_cast<std::size_t>(components) * input.vertex_count; ++i)
      attribute.values.push_back(static_cast<float>(random.integer(low, high)));
    input.attributes.push_back(attribute);
  };
  add("JOINTS_0", 4, kUnsignedShort, false, 0, 65535);
  add("COLOR_0", 4, kUnsignedByte, true, 0, 255);
  add("TEXCOORD_0", 2, kShort, true, -32768, 32767);
  const DracoOutput ordered = encode_draco(input, {}, true);
  const auto mesh = decode(ordered);
  for (std::size_t a = 1; a < input.attributes.size(); ++a)
    EXPECT_EQ(values_of(*mesh, ordered.unique_ids[a]), input.attributes[a].values) << input.attributes[a].name;

  // Edgebreaker renumbers: every corner of every triangle must still be there, with the same integers.
  const DracoOutput renumbered = encode_draco(input, {}, false);
  const auto other = decode(renumbered);
  const auto corners = [](const std::vector<std::uint32_t>& indices, const std::vector<float>& values) {
    std::vector<std::array<float, 4>> out;
    for (const std::uint32_t i : indices)
      out.push_back({values[4 * i], values[4 * i + 1], values[4 * i + 2], values[4 * i + 3]});
    std::sort(out.begin(), out.end());
    return out;
  };
  EXPECT_EQ(corners(indices_of(*other), values_of(*other, renumbered.unique_ids[1])),
            corners(input.indices, input.attributes[1].values));
  EXPECT_NE(indices_of(*other), input.indices);  // why order that matters needs the sequential method
}

// Sorted corners of the triangles, the least corner first in each: a form that does not depend on numbering.
std::vector<std::array<long, 9>> triangle_set(const std::vector<std::uint32_t>& indices,
                                              const std::vector<float>& positions, float step) {
  std::vector<std::array<long, 9>> out;
  for (std::size_t t = 0; t < indices.size(); t += 3) {
    std::array<std::array<long, 3>, 3> corner;
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t c = 0; c < 3; ++c) corner[k][c] = std::lround(positions[3 * indices[t + k] + c] / step);
    std::rotate(corner.begin(), std::min_element(corner.begin(), corner.end()), corner.end());
    std::array<long, 9> triangle;
    for (std::size_t i = 0; i < 9; ++i) triangle[i] = corner[i / 3][i % 3];
    out.push_back(triangle);
  }
  std::sort(out.begin(), out.end());
  return out;
}

TEST(DracoEncoder, EdgebreakerKeepsEveryTriangleAndItsWinding) {
  // Points on whole numbers; steps of 1/655 do not move them to others.
  DracoInput input;
  DracoAttribute position{"POSITION", 3, 5126, false, {}};
  constexpr std::uint32_t kSide = 21;
  for (std::uint32_t j = 0; j < kSide; ++j)
    for (std::uint32_t i = 0; i < kSide; ++i) {
      position.values.insert(position.values.end(),
                             {static_cast<float>(i), static_cast<float>(j), static_cast<float>(i * j % 7)});
      if (i + 1 == kSide || j + 1 == kSide || (i * 7 + j) % 11 == 0) continue;  // with holes
      const std::uint32_t a = j * kSide + i;
      input.indices.insert(input.indices.end(), {a, a + 1, a + kSide + 1, a, a + kSide + 1, a + kSide});
    }
  input.vertex_count = kSide * kSide;
  input.attributes = {position};
  const DracoOutput output = encode_draco(input, {}, false);
  const auto mesh = decode(output);
  auto expected = triangle_set(input.indices, position.values, 1.0f);
  EXPECT_EQ(triangle_set(indices_of(*mesh), values_of(*mesh, output.unique_ids[0]), 1.0f), expected);
  // The comparison sees a triangle turned over.
  std::swap(input.indices[0], input.indices[1]);
  EXPECT_NE(triangle_set(input.indices, position.values, 1.0f), expected);
}

TEST(DracoEncoder, TheSameMeshGivesTheSameBytes) {
  for (const bool sequential : {false, true}) {
    Random a(5), b(5);
    EXPECT_EQ(encode_draco(random_mesh(a, 100, 150), {}, sequential).bytes,
              encode_draco(random_mesh(b, 100, 150), {}, sequential).bytes);
  }
}

}  // namespace
}  // namespace tessera::replay::draco_encoder_test
