#include "tilecore/procedural/sparse_pass.h"

#include <algorithm>
#include <cmath>

namespace tessera::tilecore {
namespace {

using scene::FrameGeometry;
using scene::PosedDrawable;

constexpr int kMaxTuples = 2048;  // along one parameter
constexpr int kProbeTuples = 8;   // along each parameter, to choose how many

// Raster-space places of tuples of a piece, at both motion keys.
struct Places {
  int columns = 0, rows = 0;
  std::array<std::vector<float>, 2> x, y, z;
};

void evaluate_tuples(const ArrayProgram& program, int columns, int rows, SampleRegisters& registers, Places& out) {
  out.columns = columns;
  out.rows = rows;
  const std::size_t count = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  for (std::size_t key = 0; key < 2; ++key)
    for (auto* v : {&out.x[key], &out.y[key], &out.z[key]}) v->resize(count);
  for (std::size_t first = 0; first < count; first += kArraySamples) {
    const std::size_t n = std::min(kArraySamples, count - first);
    for (std::size_t k = 0; k < n; ++k) {
      const std::size_t at = first + k;
      registers.u[k] =
          (static_cast<float>(at % static_cast<std::size_t>(columns)) + 0.5f) / static_cast<float>(columns);
      registers.v[k] = (static_cast<float>(at / static_cast<std::size_t>(columns)) + 0.5f) / static_cast<float>(rows);
    }
    run_procedure(program, n, registers);
    for (std::size_t key = 0; key < 2; ++key) {
      const auto& from = registers.at[std::min<std::size_t>(key, static_cast<std::size_t>(program.keys - 1))];
      for (std::size_t k = 0; k < n; ++k) {
        const float z = from[SampleRegisters::kZ][k], w = program.orthographic || program.divided ? 1.0f : z;
        out.x[key][first + k] = from[SampleRegisters::kX][k] / w;
        out.y[key][first + k] = from[SampleRegisters::kY][k] / w;
        out.z[key][first + k] = z;
      }
    }
  }
}

// Distance on screen between two tuples, the larger of the keys; 0 if one is not in front of the camera.
double distance(const Places& p, std::size_t a, std::size_t b, double near) {
  double out = 0;
  for (std::size_t key = 0; key < 2; ++key) {
    if (!(static_cast<double>(p.z[key][a]) >= near && static_cast<double>(p.z[key][b]) >= near)) continue;
    const double dx = std::abs(static_cast<double>(p.x[key][a]) - static_cast<double>(p.x[key][b])),
                 dy = std::abs(static_cast<double>(p.y[key][a]) - static_cast<double>(p.y[key][b]));
    if (std::isfinite(dx + dy)) out = std::max({out, dx, dy});
  }
  return out;
}

// Distance to the farther of the two neighbours along one parameter: `step` tuples on, `place` of `count`.
double radius(const Places& p, std::size_t at, std::size_t step, int place, int count, double near) {
  double out = 0;
  if (place > 0) out = std::max(out, distance(p, at, at - step, near));
  if (place + 1 < count) out = std::max(out, distance(p, at, at + step, near));
  return out;
}

int tuples_for(double length, double spacing) {
  return static_cast<int>(std::clamp(std::ceil(length / spacing), 4.0, static_cast<double>(kMaxTuples)));
}

// Longest way across the piece along each parameter.
void choose_tuples(const Places& probe, double spacing, double near, int& columns, int& rows) {
  double longest_u = 0, longest_v = 0;
  for (int k = 0; k < kProbeTuples; ++k) {
    double along_u = 0, along_v = 0;
    for (int i = 1; i < kProbeTuples; ++i) {
      const auto at = [&](int column, int row) { return static_cast<std::size_t>(row * kProbeTuples + column); };
      along_u += distance(probe, at(i - 1, k), at(i, k), near);
      along_v += distance(probe, at(k, i - 1), at(k, i), near);
    }
    longest_u = std::max(longest_u, along_u);
    longest_v = std::max(longest_v, along_v);
  }
  columns = tuples_for(longest_u, spacing);
  rows = tuples_for(longest_v, spacing);
}

}  // namespace

void run_published_pass(const FrameGeometry& frame, const IntRect& region, const ProcedureSettings& settings, int side,
                        std::uint32_t drawable_number, std::uint32_t piece_number, SampleRegisters& registers,
                        SparseResult& out) {
  const PosedDrawable& drawable = frame.drawables[drawable_number];
  ArrayProgram program;
  program.shape = drawable.procedure->shape;
  program.input = &drawable.procedure->pieces[piece_number].input;
  if (drawable.deforming) program.close = &drawable.procedure_close->pieces[piece_number].input;
  program.to_raster = drawable.to_raster;
  program.keys = drawable.moving ? 2 : 1;
  program.orthographic = frame.projection.orthographic;
  program.divided = !drawable.moving;
  // A sample is written to one sub-pixel, so steps of one sub-pixel are enough.
  const double near = frame.projection.near, reach = std::min(settings.spacing, 1.0) / side;
  Places places;
  evaluate_tuples(program, kProbeTuples, kProbeTuples, registers, places);
  int columns, rows;
  choose_tuples(places, settings.sparse_spacing / side, near, columns, rows);
  evaluate_tuples(program, columns, rows, registers, places);
  out.counters.sparse_evaluations +=
      static_cast<std::uint64_t>(columns) * static_cast<std::uint64_t>(rows) + kProbeTuples * kProbeTuples;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const auto at =
          static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(column);
      const double radius_u = radius(places, at, 1, column, columns, near),
                   radius_v = radius(places, at, static_cast<std::size_t>(columns), row, rows, near);
      const double pad = settings.padding * std::max(radius_u, radius_v);
      ParameterCell cell;
      cell.drawable = drawable_number;
      cell.piece = piece_number;
      cell.u0 = static_cast<float>(column) / static_cast<float>(columns),
      cell.u1 = static_cast<float>(column + 1) / static_cast<float>(columns);
      cell.v0 = static_cast<float>(row) / static_cast<float>(rows),
      cell.v1 = static_cast<float>(row + 1) / static_cast<float>(rows);
      double low_x = 1e30, low_y = 1e30, high_x = -1e30, high_y = -1e30, low_z = 1e30, high_z = 0;
      for (std::size_t key = 0; key < 2; ++key) {
        const auto x = static_cast<double>(places.x[key][at]), y = static_cast<double>(places.y[key][at]),
                   z = static_cast<double>(places.z[key][at]);
        if (!(z >= near && std::isfinite(x) && std::isfinite(y))) continue;
        low_x = std::min(low_x, x - pad), high_x = std::max(high_x, x + pad);
        low_y = std::min(low_y, y - pad), high_y = std::max(high_y, y + pad);
        low_z = std::min(low_z, z), high_z = std::max(high_z, z);
      }
      if (!(low_x <= high_x) || high_x < region.x0 || high_y < region.y0 || low_x > region.x1 || low_y > region.y1)
        continue;
      bool clamped = false;
      // Both directions may lie along either axis: each takes half of the reach.
      cell.steps = CellSteps::for_reach({radius_u / 2, 0, 0, radius_v / 2}, reach / 2, reach, clamped);
      cell.line_steps = cell.steps;
      out.counters.rates_clamped += clamped ? 1 : 0;
      cell.x0 = static_cast<float>(low_x), cell.y0 = static_cast<float>(low_y), cell.x1 = static_cast<float>(high_x),
      cell.y1 = static_cast<float>(high_y);
      cell.near_z = static_cast<float>(low_z * 0.999);
      keep_cell(frame, settings, cell, static_cast<float>(high_z), false, nullptr, 0, out);
    }
}

}  // namespace tessera::tilecore
