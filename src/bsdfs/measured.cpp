// SPDX-License-Identifier: Apache-2.0
// measured: a measured material from a file of the RGL database [DupuyJakob2018]; black from the other side.
//
// | name     | type   | default  | meaning                                                      |
// |----------|--------|----------|--------------------------------------------------------------|
// | filename | string | required | a file of the database, in RGB or spectral: see tensor_file.h |
//
// With m the half vector, u(m) its angles on the unit square and s the point that the warp of visible normals maps to
// u(m), all for the direction of the camera,
//     f cos = spectra(s) D(u(m)) / (4 sigma),            [DupuyJakob2018], as in Mitsuba,
// or spectra(s) alone if the file says so. Samples are drawn from the luminance over s, then warped to visible normals.
// Tables are bilinear, and interpolated linearly between the measured camera directions, so the model is not quite
// reciprocal, and light paths get its adjoint. Negative channels are clamped to 0. Spectra are converted to RGB like
// other reflectances: each wavelength of the file adds its share, the colour of a spectrum that is 1 there and falls to
// 0 at its neighbours.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <optional>

#include "bsdfs/inputs.h"
#include "bsdfs/registry.h"
#include "core/memory_limit.h"
#include "tensors/tensor_file.h"
#include "tensors/warp_table.h"

namespace covary {
namespace {

struct Material {
  ParameterNodes nodes;  ///< azimuth and polar angle of the camera's direction
  bool isotropic = false;
  /// Number of symmetric sectors of azimuth: 1, 2 (point symmetry about the normal) or 4 (mirrored in x and in y).
  int parts = 1;
  bool by_normals = false;  ///< spectra do not include D / (4 sigma)
  BilinearTable<float> ndf, sigma;
  WarpTable visible_normals, luminance;
  BilinearTable<Spectrum> spectra;
};

/// Angle from z, without the cancellation of acos near it.
float angle_from_z(const Vec3& w) { return 2 * std::asin(std::min(0.5f * length(w - Vec3{0, 0, 1}), 1.0f)); }
/// Maps angles to the unit square; the square root resolves the peak better.
Vec2 to_square(float theta, float phi) {
  const float turn = phi / kTwoPi + 0.5f;
  return {std::sqrt(theta * 2 / kPi), turn - std::floor(turn)};
}

/// The material as seen from the camera direction `wo`, wo.z > 0.
class MaterialView {
 public:
  MaterialView(const Material& material, const Vec3& wo) : material_(material) {
    // Symmetry maps directions to the measured sector.
    if (material.parts >= 2) flip_y_ = !std::signbit(wo.y);
    flip_x_ = material.parts == 4 ? !std::signbit(wo.x) : flip_y_;
    wo_ = flipped(wo);
    theta_ = angle_from_z(wo_), phi_ = std::atan2(wo_.y, wo_.x);
    mix_ = material.nodes.at(phi_, theta_);
  }

  BsdfValue eval(const Vec3& wi) const {
    const Vec3 m = normalize(wo_ + flipped(wi));
    const float theta_m = angle_from_z(m), phi_m = std::atan2(m.y, m.x);
    const Vec2 u = to_square(theta_m, material_.isotropic ? phi_m - phi_ : phi_m);
    const WarpTable::Result normal = material_.visible_normals.invert(mix_, u);
    Spectrum value = material_.spectra.eval(mix_, normal.uv);
    if (material_.by_normals) {
      const float sigma = material_.sigma.eval(0, to_square(theta_, phi_));
      value *= sigma > 0 ? material_.ndf.eval(0, u) / (4 * sigma) : 0;
    }
    // From the unit square to normals, theta = pi/2 u² and phi = 2 pi v - pi, then to directions [Walter2007] Eq. (14).
    // The Jacobian vanishes at u = 0: clamped as in Mitsuba, within 1e-4 radians of the normal.
    const float jacobian = std::max(2 * kPi * kPi * u.x * std::sin(theta_m), 1e-6f) * 4 * dot(wo_, m);
    const float density = normal.pdf * material_.luminance.pdf(mix_, normal.uv);
    for (int c = 0; c < 3; ++c) value[c] = std::max(value[c], 0.0f);
    return {value, jacobian > 0 ? density / jacobian : 0};
  }

  /// nullopt if the direction is below the surface.
  std::optional<Vec3> sample(Vec2 u) const {
    const Vec2 s = material_.luminance.sample(mix_, {u.y, u.x}).uv;
    const Vec2 at = material_.visible_normals.sample(mix_, s).uv;
    const float theta = sqr(at.x) * kPi / 2, phi = (2 * at.y - 1) * kPi + (material_.isotropic ? phi_ : 0);
    const float r = std::sin(theta);
    const Vec3 m{r * std::cos(phi), r * std::sin(phi), std::cos(theta)};
    const Vec3 wi = reflect(wo_, m);
    if (!(wi.z > 0 && dot(wo_, m) > 0)) return std::nullopt;
    return flipped(wi);
  }

 private:
  Vec3 flipped(const Vec3& w) const { return {flip_x_ ? -w.x : w.x, flip_y_ ? -w.y : w.y, w.z}; }

  const Material& material_;
  bool flip_x_ = false, flip_y_ = false;
  Vec3 wo_;
  float theta_, phi_;
  SliceMix mix_;
};

class MeasuredClosure final : public BsdfClosure {
 public:
  MeasuredClosure(const Material& material, TransportMode mode) : material_(material), mode_(mode) {}

  uint32_t flags() const override { return kGlossyReflection; }
  BsdfValue eval(const Vec3& wo, const Vec3& wi) const override {
    if (!(wo.z > 0 && wi.z > 0)) return {};
    BsdfValue v = MaterialView(material_, wo).eval(wi);
    if (mode_ == TransportMode::kImportance) v.value = MaterialView(material_, wi).eval(wo).value * (wi.z / wo.z);
    return v;
  }
  BsdfSample sample(const Vec3& wo, float, Vec2 u) const override {
    BsdfSample s;
    if (!(wo.z > 0)) return s;
    const std::optional<Vec3> wi = MaterialView(material_, wo).sample(u);
    if (!wi) return s;
    const BsdfValue v = eval(wo, *wi);
    if (!(v.pdf_solid_angle > 0)) return s;
    s.wi = *wi;
    s.pdf = v.pdf_solid_angle;
    s.weight = v.value / s.pdf;
    s.flags = kGlossyReflection;
    return s;
  }
  int n_lobes() const override { return 1; }
  void lobe_pmfs(const Vec3& wo, float* pmfs) const override { pmfs[0] = wo.z > 0 ? 1 : 0; }
  void lobe_pdfs(const Vec3& wo, const Vec3& wi, float* pdfs) const override {
    pdfs[0] = wo.z > 0 && wi.z > 0 ? MaterialView(material_, wo).eval(wi).pdf_solid_angle : 0;
  }

 private:
  const Material& material_;
  TransportMode mode_;
};

/// Directional albedo for `wo`.
Spectrum reflected(const Material& material, const Vec3& wo) {
  constexpr int kGrid = 16;
  const MeasuredClosure closure(material, TransportMode::kRadiance);
  Spectrum sum(0);
  for (int y = 0; y < kGrid; ++y)
    for (int x = 0; x < kGrid; ++x)
      sum += closure.sample(wo, 0, Vec2{static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f} * (1.0f / kGrid))
                 .weight;
  return sum / (kGrid * kGrid);
}

class Measured final : public Bsdf {
 public:
  explicit Measured(Material material) : material_(std::move(material)) {
    albedo_ = clamp01(reflected(material_, normalize(Vec3{-1, -1, 2})));
  }
  uint32_t flags() const override { return kGlossyReflection; }
  const BsdfClosure* bind(const SurfaceHit&, bool, TransportMode mode, Arena& arena) const override {
    return arena.make<MeasuredClosure>(material_, mode);
  }
  bool needs_derivatives() const override { return !material_.isotropic; }
  Spectrum albedo(const SurfaceHit&) const override { return albedo_; }

 private:
  Material material_;
  Spectrum albedo_;
};

/// Reads the fields of a file. All errors are Error(kInput) naming the file.
class MaterialFile {
 public:
  explicit MaterialFile(const std::string& path) : path_(path), file_(path) {}

  Material read() const {
    if (file_.has("M")) throw refusal("holds a polarised measurement; light is not polarised here");
    Material m;
    m.nodes.a = read_nodes("phi_i", -2 * kTwoPi, 2 * kTwoPi);
    m.nodes.b = read_nodes("theta_i", 0, kPi);
    const uint64_t n_phi = m.nodes.a.size(), n_theta = m.nodes.b.size();
    expect("ndf", {0, 0}), expect("sigma", {0, 0});
    expect("vndf", {n_phi, n_theta, 0, 0}), expect("luminance", {n_phi, n_theta, 0, 0});
    const GridSize of_spectra = grid("luminance");
    const bool spectral = file_.has("wavelengths");
    const std::vector<Spectrum> channels = spectral ? wavelength_colours() : rgb_colours();
    expect(spectral ? "spectra" : "rgb", {n_phi, n_theta, channels.size(), static_cast<uint64_t>(of_spectra.height),
                                          static_cast<uint64_t>(of_spectra.width)});
    expect("jacobian", {1});
    // The tables of visible normals and luminance are stored with two cumulative sums each.
    require_memory(path_, "a measured material", 3.0 * static_cast<double>(file_.n_bytes()));

    m.isotropic = n_phi <= 2;
    if (!m.isotropic) m.parts = static_cast<int>(std::lround(kTwoPi / (m.nodes.a.back() - m.nodes.a.front())));
    if (m.parts != 1 && m.parts != 2 && m.parts != 4)
      throw refusal(fmt::format("has azimuths 'phi_i' from {} to {}; expected a whole, half or quarter turn",
                                m.nodes.a.front(), m.nodes.a.back()));
    m.by_normals = file_.bytes("jacobian")[0] != 0;
    m.ndf = {file_.floats("ndf"), grid("ndf")};
    m.sigma = {file_.floats("sigma"), grid("sigma")};
    m.visible_normals = warp("vndf");
    m.luminance = warp("luminance");
    m.spectra = {colours(spectral ? "spectra" : "rgb", channels, m.nodes.n_slices(), of_spectra.n()), of_spectra};
    return m;
  }

 private:
  Error refusal(const std::string& what) const { return {ErrorCode::kInput, path_ + ": " + what}; }

  /// Checks the shape of a field; 0 stands for any length of at least 2.
  void expect(const std::string& field, const std::vector<uint64_t>& shape) const {
    const std::vector<uint64_t>& found = file_.shape(field);
    bool right = found.size() == shape.size();
    for (size_t i = 0; right && i < shape.size(); ++i)
      right = shape[i] == 0 ? found[i] >= 2 && found[i] <= kMaxCells : found[i] == shape[i];
    std::vector<std::string> wanted;
    for (const uint64_t length : shape) wanted.push_back(length == 0 ? "2 or more" : std::to_string(length));
    if (!right)
      throw refusal(fmt::format("has the shape {} in field '{}'; expected [{}]", shape_text(found), field,
                                fmt::join(wanted, ", ")));
  }
  std::vector<float> read_nodes(const std::string& field, float least, float most) const {
    const std::vector<float> nodes = file_.floats(field);
    bool right = file_.shape(field).size() == 1 && !nodes.empty() && nodes.front() >= least && nodes.back() <= most;
    for (size_t i = 1; right && i < nodes.size(); ++i) right = nodes[i - 1] < nodes[i];
    if (!right) throw refusal(fmt::format("has a field '{}' that is not a list of increasing angles", field));
    return nodes;
  }
  /// The last two dimensions of a field.
  GridSize grid(const std::string& field) const {
    const std::vector<uint64_t>& shape = file_.shape(field);
    return {static_cast<int>(shape.back()), static_cast<int>(shape[shape.size() - 2])};
  }
  WarpTable warp(const std::string& field) const {
    try {
      return {file_.floats(field), grid(field), field};
    } catch (const Error& error) {
      throw refusal(error.what());
    }
  }
  static std::vector<Spectrum> rgb_colours() { return {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}; }
  /// What one unit at each wavelength adds to the colour of a reflectance.
  std::vector<Spectrum> wavelength_colours() const {
    constexpr uint64_t kMax = 1024;
    const std::vector<float> nm = file_.floats("wavelengths");
    bool right = nm.size() >= 2 && nm.size() <= kMax;
    for (size_t i = 1; right && i < nm.size(); ++i) right = nm[i - 1] < nm[i];
    if (!right) throw refusal("has a field 'wavelengths' that is not a list of increasing wavelengths");
    std::vector<Spectrum> result;
    for (size_t i = 0; i < nm.size(); ++i) {
      // Differences of spectra, because conversions clamp what is below 0.
      SampledSpectrum with, without;
      for (size_t k = 0; k < nm.size(); ++k) {
        without.samples.emplace_back(nm[k], 1.0f);
        with.samples.emplace_back(nm[k], k == i ? 2.0f : 1.0f);
      }
      result.push_back(spectrum_to_rgb(with, SpectrumRole::kIndex) - spectrum_to_rgb(without, SpectrumRole::kIndex));
    }
    return result;
  }
  /// The file stores planar channels, or one plane for each wavelength.
  std::vector<Spectrum> colours(const std::string& field, const std::vector<Spectrum>& channels, size_t n_slices,
                                size_t n) const {
    const std::vector<float> planes = file_.floats(field);
    std::vector<Spectrum> result(n_slices * n);
    for (size_t slice = 0; slice < n_slices; ++slice)
      for (size_t c = 0; c < channels.size(); ++c)
        for (size_t i = 0; i < n; ++i)
          result[slice * n + i] += channels[c] * planes[(slice * channels.size() + c) * n + i];
    return result;
  }

  static constexpr uint64_t kMaxCells = 1 << 16;  // along one side of a grid
  std::string path_;
  TensorFile file_;
};

}  // namespace

std::shared_ptr<Bsdf> make_measured(Parameters& parameters) {
  const std::string path = parameters.require_file("filename");
  if (path.empty()) return nullptr;  // already reported
  try {
    return std::make_shared<Measured>(MaterialFile(path).read());
  } catch (const Error& error) {
    parameters.error_at("filename", std::string("cannot be used: ") + error.what());
    return nullptr;
  }
}

}  // namespace covary
