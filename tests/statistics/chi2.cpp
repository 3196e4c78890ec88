// SPDX-License-Identifier: Apache-2.0
#include "statistics/chi2.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <vector>

namespace covary::statistics {

namespace {

struct Point2 {
  double x, y;
};
struct Box {
  double x0 = 0, x1 = 1, y0 = 0, y1 = 1;
};
using SquareSampler = std::function<std::optional<Point2>(const PathRandom&)>;
using SquareDensity = std::function<double(double, double)>;

// --- Quadrature ----------------------------------------------------------------------------------------------------

struct Rule {
  double integral;
  bool edge;  ///< the integrand is zero at some nodes only: its support may end inside the box
};

/// Tensor product of the 5-point Gauss-Lobatto rule, whose nodes reach the rim of the box, where the support of a
/// density often ends.
Rule lobatto(const SquareDensity& f, const Box& b) {
  static constexpr double kRim = 1 - 1e-6;  // not 1: two boxes share the rim, which may be a horizon
  static constexpr std::array<double, 5> kNodes{-kRim, -0.6546536707079771, 0, 0.6546536707079771, kRim};
  static constexpr std::array<double, 5> kWeights{0.1, 49.0 / 90, 32.0 / 45, 49.0 / 90, 0.1};
  const double cx = (b.x0 + b.x1) / 2, hx = (b.x1 - b.x0) / 2, cy = (b.y0 + b.y1) / 2, hy = (b.y1 - b.y0) / 2;
  double sum = 0;
  int n_zeros = 0;
  for (int i = 0; i < 5; ++i)
    for (int j = 0; j < 5; ++j) {
      const double value = f(cx + hx * kNodes[i], cy + hy * kNodes[j]);
      sum += kWeights[i] * kWeights[j] * value;
      n_zeros += value == 0;
    }
  return {sum * hx * hy, n_zeros > 0 && n_zeros < 25};
}

/// Splits the box in four until the integral changes by less than `tolerance`, and at least 6 times around an edge. The
/// tolerance is halved, not quartered, at each level, because an edge is a curve, which meets twice as many boxes.
/// Splits are jittered about the middle, so that errors along an edge parallel to the axes do not add up.
double integrate(const SquareDensity& f, const Box& b, const Rule& whole, double tolerance, int level) {
  const uint64_t bits = combine64(std::bit_cast<uint64_t>(b.x0 + b.x1), std::bit_cast<uint64_t>(b.y0 + b.y1));
  const double rx = 0.4 + 0.2 * (bits >> 40) * 0x1p-24, ry = 0.4 + 0.2 * (bits & 0xffffff) * 0x1p-24;
  const double mx = b.x0 + rx * (b.x1 - b.x0), my = b.y0 + ry * (b.y1 - b.y0);
  const std::array<Box, 4> parts{
      {{b.x0, mx, b.y0, my}, {mx, b.x1, b.y0, my}, {b.x0, mx, my, b.y1}, {mx, b.x1, my, b.y1}}};
  std::array<Rule, 4> values;
  double sum = 0;
  for (int i = 0; i < 4; ++i) values[i] = lobatto(f, parts[i]), sum += values[i].integral;
  const bool converged = !(std::abs(sum - whole.integral) > tolerance);  // also if NaN
  if ((converged && !(whole.edge && level < 6)) || level == 9) return sum;
  sum = 0;
  for (int i = 0; i < 4; ++i) sum += integrate(f, parts[i], values[i], tolerance / 2, level + 1);
  return sum;
}
double integrate(const SquareDensity& f, const Box& b, double tolerance) {
  return integrate(f, b, lobatto(f, b), tolerance, 0);
}

double integrate_grid(const SquareDensity& f, double tolerance, int n) {
  double sum = 0;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      sum += integrate(f, {double(i) / n, double(i + 1) / n, double(j) / n, double(j + 1) / n}, tolerance / n);
  return sum;
}

// --- Cells ---------------------------------------------------------------------------------------------------------

/// Binary tree over the unit square, built from points. The density is integrated over the leaves, which hold about 50
/// points each; subtrees with equal numbers of points are the cells of the test. Empty space is cut off, so that every
/// leaf is about as small as the details of the density in it.
class Cells {
 public:
  struct Leaf {
    Box box;
    int cell;
  };
  Cells(std::vector<Point2> points, int n_cells) {
    // The first split is at y = 1/2, the horizon, where densities of directions are discontinuous.
    nodes_.push_back({.split = 0.5, .axis = 1, .child = 1});
    nodes_.resize(3);
    const auto middle = std::partition(points.begin(), points.end(), [](const Point2& p) { return p.y < 0.5; });
    const int64_t n = std::max<int64_t>(1, points.size()), n_low = middle - points.begin();
    const int low = static_cast<int>(n_cells * n_low / n);
    build(1, {0, 1, 0, 0.5}, {points.begin(), middle}, std::max(1, low), -1, 0);
    build(2, {0, 1, 0.5, 1}, {middle, points.end()}, std::max(1, n_cells - low), -1, 0);
  }
  int find(const Point2& p) const {
    int node = 0;
    while (nodes_[node].child >= 0)
      node = nodes_[node].child + ((nodes_[node].axis ? p.y : p.x) < nodes_[node].split ? 0 : 1);
    return nodes_[node].cell;
  }
  const std::vector<Box>& boxes() const { return boxes_; }  ///< one per cell
  const std::vector<Leaf>& leaves() const { return leaves_; }

 private:
  struct Node {
    double split = 0;
    int axis = 0, child = -1, cell = -1;
  };
  void build(int node, const Box& box, std::span<Point2> points, int n_cells, int cell, int depth) {
    if (cell < 0 && (n_cells == 1 || points.size() < 64)) {
      cell = static_cast<int>(boxes_.size());
      boxes_.push_back(box);
    }
    if (points.size() < 4) return make_leaf(node, box, cell);
    const auto [x_min, x_max] = std::ranges::minmax(points, {}, &Point2::x);
    const auto [y_min, y_max] = std::ranges::minmax(points, {}, &Point2::y);
    const double dx = x_max.x - x_min.x, dy = y_max.y - y_min.y;
    // Cut off empty space, the farthest three quarters first, so that boxes grow with their distance. It goes to the
    // cell that it belongs to or, above the cells, becomes a cell.
    const auto cut_off = [&](int axis, double points_end, double box_end) {
      const double split = points_end + (box_end - points_end) / 4;
      const std::span<Point2> none;
      if (box_end > points_end)
        cut(node, box, axis, split, points, none, n_cells, 1, cell, depth);
      else
        cut(node, box, axis, split, none, points, 1, n_cells, cell, depth);
    };
    if (dx > 0 && box.x1 - x_max.x > 2 * dx) return cut_off(0, x_max.x, box.x1);
    if (dx > 0 && x_min.x - box.x0 > 2 * dx) return cut_off(0, x_min.x, box.x0);
    if (dy > 0 && box.y1 - y_max.y > 2 * dy) return cut_off(1, y_max.y, box.y1);
    if (dy > 0 && y_min.y - box.y0 > 2 * dy) return cut_off(1, y_min.y, box.y0);
    if (points.size() < 64) return make_leaf(node, box, cell);
    // Median split, along the axes in turn, unless all points are equal there.
    const int axis = dx > 0 && (dy == 0 || depth % 2) ? 0 : 1;
    const auto middle = points.begin() + points.size() / 2;
    std::nth_element(points.begin(), middle, points.end(),
                     [axis](const Point2& a, const Point2& b) { return axis ? a.y < b.y : a.x < b.x; });
    cut(node, box, axis, axis ? middle->y : middle->x, {points.begin(), middle}, {middle, points.end()}, n_cells / 2,
        n_cells - n_cells / 2, cell, depth + 1);
  }
  void make_leaf(int node, const Box& box, int cell) {
    nodes_[node].cell = cell;
    leaves_.push_back({box, cell});
  }
  void cut(int node, const Box& box, int axis, double split, std::span<Point2> low_points,
           std::span<Point2> high_points, int low_cells, int high_cells, int cell, int depth) {
    Box low = box, high = box;
    (axis ? low.y1 : low.x1) = split;
    (axis ? high.y0 : high.x0) = split;
    const int child = static_cast<int>(nodes_.size());
    nodes_[node].split = split, nodes_[node].axis = axis, nodes_[node].child = child;
    nodes_.resize(nodes_.size() + 2);
    build(child, low, low_points, low_cells, cell, depth);
    build(child + 1, high, high_points, high_cells, cell, depth);
  }
  std::vector<Node> nodes_;
  std::vector<Box> boxes_;
  std::vector<Leaf> leaves_;
};

// --- The test ------------------------------------------------------------------------------------------------------

/// Folder of this process's reports; removed at the end if all tests passed (planted bugs are rejected on purpose).
class ReportFolder {
 public:
  ReportFolder() : path_((std::filesystem::temp_directory_path() / "covary-chi2-XXXXXX").string()) {
    if (!mkdtemp(path_.data())) path_.clear();
  }
  ~ReportFolder() {
    std::error_code ignored;
    if (!path_.empty() && ::testing::UnitTest::GetInstance()->Passed()) std::filesystem::remove_all(path_, ignored);
  }
  /// Path of a new report without extension; empty if there is no folder.
  std::string next(const std::string& name) {
    if (path_.empty()) return "";
    std::string file = fmt::format("{}-{}", ++n_reports_, name.substr(0, 80));
    for (char& c : file)
      if (!std::isalnum(static_cast<unsigned char>(c)) && c != '-') c = '_';
    return path_ + "/" + file;
  }

 private:
  std::string path_;
  int n_reports_ = 0;
};

/// Writes observed and expected counts and a script that plots them; returns a sentence that names both files.
std::string write_report(const std::string& name, const std::vector<Box>& boxes, const std::vector<double>& observed,
                         const std::vector<double>& expected) {
  static ReportFolder folder;
  const std::string file = folder.next(name);
  if (file.empty()) return " (no table: cannot create a folder for temporary files)";
  const std::string csv = file + ".csv", script = file + ".py";
  std::ofstream table(csv);
  table << "cell,x0,x1,y0,y1,observed,expected\n";
  for (size_t i = 0; i < observed.size(); ++i) {
    const Box b = i < boxes.size() ? boxes[i] : Box{double(i), double(i + 1), 0, 1};
    table << fmt::format("{},{:.9g},{:.9g},{:.9g},{:.9g},{},{:.6g}\n", i, b.x0, b.x1, b.y0, b.y1, observed[i],
                         expected[i]);
  }
  std::ofstream(script) << R"(import sys, csv, matplotlib.pyplot as plt
from matplotlib.patches import Rectangle
rows = [[float(v) for v in r[1:]] for r in list(csv.reader(open(sys.argv[0][:-3] + '.csv')))[1:]]
figure, axes = plt.subplots(1, 3, figsize=(18, 6), sharex=True, sharey=True)
def value(kind, x0, x1, y0, y1, observed, expected):
    area = (x1 - x0) * (y1 - y0)
    return [observed / area, expected / area, (observed - expected) / max(expected, 1) ** 0.5][kind]
for kind, title in enumerate(['observed density', 'expected density', '(observed - expected) / sigma']):
    values = [value(kind, *r) for r in rows]
    low, high = (-6, 6) if kind == 2 else (0, max(value(1, *r) for r in rows) or 1)
    for r, v in zip(rows, values):
        t = min(max((v - low) / (high - low), 0), 1)
        axes[kind].add_patch(Rectangle((r[0], r[2]), r[1] - r[0], r[3] - r[2],
                                       color=plt.cm.coolwarm(t) if kind == 2 else plt.cm.viridis(t)))
    axes[kind].set_title(title), axes[kind].set_xlim(min(r[0] for r in rows), max(r[1] for r in rows))
    axes[kind].set_ylim(1, 0), axes[kind].set_xlabel('phi / 2 pi, or u'), axes[kind].set_ylabel('(1 - z) / 2, or v')
plt.savefig(sys.argv[0][:-3] + '.png')
)";
  return fmt::format("\n  table: {}\n  plot:  python3 {}", csv, script);
}

/// Two independent tests: whether the fraction of valid samples is the integral of the density, and whether valid
/// samples are distributed like the density. The p-value combines both (Sidak).
Chi2Result compare(const std::vector<Box>& boxes, const std::vector<double>& observed,
                   const std::vector<double>& expected, double n, double zero_density_samples,
                   const Chi2Options& options) {
  Chi2Result result;
  double n_observed = 0, n_expected = 0;
  bool finite = true;
  for (size_t i = 0; i < observed.size(); ++i) {
    n_observed += observed[i], n_expected += expected[i];
    finite = finite && std::isfinite(expected[i]) && expected[i] >= -1e-3;
  }
  result.mass = n_expected / n, result.fraction = n_observed / n;
  const double mass_variance = std::max(0.0, result.mass * (1 - result.mass)) / n;
  const TestResult mass_test =
      z_test(result.fraction, mass_variance, result.mass, options.alpha, options.mass_tolerance);

  double shape_p_value = 1;
  if (finite && n_expected > 0) {
    // Cells, smallest first, so that those with an expected count below 5 are pooled, with the next larger if needed.
    std::vector<std::pair<double, double>> cells;
    for (size_t i = 0; i < observed.size(); ++i) cells.emplace_back(expected[i] * n_observed / n_expected, observed[i]);
    std::sort(cells.begin(), cells.end());
    std::pair<double, double> pool{0, 0};
    const auto add = [&](double e, double o) { result.statistic += (o - e) * (o - e) / e, ++result.dof; };
    for (const auto& [e, o] : cells) {
      if (pool.first < 5 && (e < 5 || pool.first > 0))
        pool.first += e, pool.second += o;
      else
        add(e, o);
    }
    if (pool.first > 0) add(pool.first, pool.second);
    --result.dof;
    if (result.dof > 0) shape_p_value = chi2_p_value(result.statistic, result.dof);
  }
  const double least = std::min(shape_p_value, mass_test.p_value);
  result.p_value = mass_variance > 0 ? least * (2 - least) : shape_p_value;

  std::string why;
  if (!finite)
    why = "the density is negative or not finite somewhere";
  else if (!(mass_test.p_value >= options.alpha / 2))
    why = fmt::format("the density integrates to {:.5f}, but {:.5f} of the samples succeed", result.mass,
                      result.fraction);
  else if (zero_density_samples > 2e-5 * n)
    why = fmt::format("{} samples fall where the density is zero", zero_density_samples);
  else if (!(result.p_value >= options.alpha))
    why = "samples and density differ";
  result.accepted = why.empty();
  if (!result.accepted && finite && n_expected > 0) {  // report the cell with the largest contribution
    const auto contribution = [&](size_t i) {
      return std::abs(observed[i] - expected[i]) / std::sqrt(expected[i] + 1);
    };
    size_t worst = 0;
    for (size_t i = 1; i < observed.size(); ++i)
      if (contribution(i) > contribution(worst)) worst = i;
    why += fmt::format(" (most in cell {}: observed {}, expected {:.1f})", worst, observed[worst], expected[worst]);
  }
  result.message = fmt::format("{}: {}; chi2 = {:.1f}, dof = {}, p = {:.3g}, alpha = {:.3g}, N = {}, mass = {:.5f}",
                               options.name, result.accepted ? "accepted" : why, result.statistic, result.dof,
                               result.p_value, options.alpha, n, result.mass);
  if (!result.accepted) result.message += write_report(options.name, boxes, observed, expected);
  return result;
}

Chi2Result run(const SquareSampler& sample, const SquareDensity& pdf, const Chi2Options& options) {
  const auto draw = [&](uint32_t pass, uint64_t i) {
    return sample(PathRandom(Sampling::kIndependent, options.seed, pass, 0, i));
  };
  std::vector<Point2> pilot;  // enough to resolve the density even if most samples fail
  const size_t n_wanted = 200 * static_cast<size_t>(options.n_cells);
  for (int i = 0; i < 4 * options.n_samples && pilot.size() < n_wanted; ++i)
    if (const auto p = draw(1, i)) pilot.push_back(*p);
  const Cells cells(std::move(pilot), options.n_cells);

  const size_t n_cells = cells.boxes().size();
  std::vector<double> observed(n_cells), expected(n_cells);
  double zero_density_samples = 0;
  for (int i = 0; i < options.n_samples; ++i) {
    const auto p = draw(0, i);
    if (!p) continue;
    ++observed[cells.find(*p)];
    if (i < options.n_samples / 8 && !(pdf(p->x, p->y) > 0)) zero_density_samples += 8;
  }
  // Integrate each cell to a tenth of the standard deviation of its count.
  const double tolerance = 0.1 / std::sqrt(double(options.n_samples) * n_cells) * n_cells / cells.leaves().size();
  for (const Cells::Leaf& leaf : cells.leaves())
    expected[leaf.cell] += options.n_samples * integrate(pdf, leaf.box, tolerance);
  return compare(cells.boxes(), observed, expected, options.n_samples, zero_density_samples, options);
}

Point2 square_from_direction(const Vec3& w) {
  double x = std::atan2(double(w.y), double(w.x)) / (2 * std::numbers::pi);
  if (x < 0) x += 1;
  // (1 - z) / 2 without cancellation near the poles, where narrow lobes lie.
  const double s2 = double(w.x) * w.x + double(w.y) * w.y, z = std::abs(double(w.z));
  const double near = std::min(0.5, s2 / (2 * (1 + z)));
  return {std::clamp(x, 0.0, 1.0), w.z >= 0 ? near : 1 - near};
}

}  // namespace

Vec3 direction_from_square(double x, double y) {
  const double z = 1 - 2 * y, r = std::sqrt(std::max(0.0, 4 * y * (1 - y))), phi = 2 * std::numbers::pi * x;
  return {static_cast<float>(r * std::cos(phi)), static_cast<float>(r * std::sin(phi)), static_cast<float>(z)};
}

Chi2Result chi2_sphere(const Sampler<Vec3>& sample, const Density<Vec3>& pdf, const Chi2Options& options) {
  return run(
      [&](const PathRandom& random) -> std::optional<Point2> {
        const auto w = sample(random);
        return w ? std::optional(square_from_direction(*w)) : std::nullopt;
      },
      [&](double x, double y) { return 4 * std::numbers::pi * pdf(direction_from_square(x, y)); }, options);
}

Chi2Result chi2_square(const Sampler<Vec2>& sample, const Density<Vec2>& pdf, const Chi2Options& options) {
  return run(
      [&](const PathRandom& random) -> std::optional<Point2> {
        const auto p = sample(random);
        return p ? std::optional(Point2{p->x, p->y}) : std::nullopt;
      },
      [&](double x, double y) {
        return pdf({static_cast<float>(x), static_cast<float>(y)});
      },
      options);
}

Chi2Result chi2_discrete(std::span<const double> observed, std::span<const double> probabilities,
                         const Chi2Options& options) {
  double n = 0;
  for (const double o : observed) n += o;
  std::vector<double> expected;
  double zero_density_samples = 0;
  for (size_t i = 0; i < probabilities.size(); ++i) {
    expected.push_back(n * probabilities[i]);
    if (probabilities[i] == 0) zero_density_samples += n * (observed[i] > 0);
  }
  return compare({}, {observed.begin(), observed.end()}, expected, n, zero_density_samples, options);
}

double integrate_sphere(const Density<Vec3>& f, double tolerance, int n) {
  return integrate_grid([&](double x, double y) { return 4 * std::numbers::pi * f(direction_from_square(x, y)); },
                        tolerance, n);
}
double integrate_square(const Density<Vec2>& f, double tolerance, int n) {
  return integrate_grid(
      [&](double x, double y) {
        return f({static_cast<float>(x), static_cast<float>(y)});
      },
      tolerance, n);
}

}  // namespace covary::statistics
