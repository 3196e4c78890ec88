// SPDX-License-Identifier: Apache-2.0
// covary combine: image-space control variates for images made by any renderer.
#include <fmt/format.h>

#include <tbb/global_control.h>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "commands.h"
#include "estimators/cv_baseline.h"
#include "estimators/grouped_file.h"
#include "estimators/iduw.h"
#include "estimators/iicv.h"
#include "estimators/input_doctor.h"
#include "film/output_file.h"

namespace covary {
namespace {

struct CombineOptions {
  std::vector<std::string> crn, pt;
  std::string output, crn_layer, pt_layer, estimator = "iicv", coefficients, json;
  bool paper = false, asymmetric = false, exclude_target = false, error = false, force = false, quiet = false;
  std::optional<int> k, window, pilot_window, feedback_window, samples;
  std::optional<float> ridge, sample_share, conservation, feedback_bandwidth;
  std::optional<Penalty> penalty;
  std::optional<bool> feedback;
  double memory_mib = 4096;
  int threads = 0;
};

/// One of the three estimators with its options, as a function of a part of the images.
struct Method {
  std::function<EstimatorResult(const GroupedImage&, const GroupedImage&)> apply;
  int reach = 0;  ///< rows beyond its own that a band needs; -1: the method needs the whole image
  std::vector<std::string> problems;
};

template <typename T, typename U>
void set(T& target, const std::optional<U>& value) {
  if (value) target = *value;
}

[[noreturn]] void usage(const std::string& message) { throw Error(ErrorCode::kUsage, message); }

Method make_iicv(const CombineOptions& o) {
  IicvOptions options = o.paper ? IicvOptions::paper() : IicvOptions();
  set(options.k, o.k);
  set(options.window, o.window);
  set(options.pilot_window, o.pilot_window);
  set(options.penalty, o.penalty);
  set(options.ridge, o.ridge);
  set(options.sample_share, o.sample_share);
  set(options.conservation, o.conservation);
  set(options.feedback, o.feedback);
  set(options.feedback_options.window, o.feedback_window);
  set(options.feedback_options.bandwidth, o.feedback_bandwidth);
  if (o.asymmetric) options.symmetric = false;
  if (o.exclude_target) options.include_target = false;
  if (!o.coefficients.empty()) options.shared_coefficients = o.coefficients == "shared";
  options.std_error = o.error;
  return {[options](const GroupedImage& crn, const GroupedImage& pt) { return iicv(crn, pt, options); },
          iicv_reach(options), options.validate()};
}

Method make_cv_baseline(const CombineOptions& o) {
  CvBaselineOptions options;
  set(options.k, o.k);
  set(options.window, o.window);
  set(options.ridge, o.ridge);
  if (o.exclude_target) options.include_target = false;
  if (!o.coefficients.empty()) options.shared_coefficients = o.coefficients == "shared";
  options.std_error = o.error;
  return {[options](const GroupedImage& crn, const GroupedImage& pt) { return cv_baseline(crn, pt, options); },
          options.window / 2, options.validate()};
}

Method make_iduw(const CombineOptions& o, const GroupedFile& crn) {
  IduwOptions options;
  set(options.window, o.window);
  options.samples = static_cast<int>(crn.samples());
  set(options.samples, o.samples);
  if (options.samples == 0) usage("--estimator iduw needs --samples N, the samples per pixel of the CRN image");
  return {[options](const GroupedImage& crn_image, const GroupedImage& pt) { return iduw(crn_image, pt, options); }, -1,
          options.validate()};
}

/// Options of another estimator than the one chosen.
void check_options(const CombineOptions& o) {
  const bool is_iicv = o.estimator == "iicv", is_iduw = o.estimator == "iduw";
  const std::vector<std::tuple<bool, const char*, const char*>> wrong = {
      {!is_iicv && o.paper, "--paper", "iicv"},
      {!is_iicv && o.penalty.has_value(), "--penalty", "iicv"},
      {!is_iicv && o.pilot_window.has_value(), "--pilot-window", "iicv"},
      {!is_iicv && o.asymmetric, "--asymmetric", "iicv"},
      {!is_iicv && o.sample_share.has_value(), "--sample-share", "iicv"},
      {!is_iicv && o.conservation.has_value(), "--conservation", "iicv"},
      {!is_iicv && (o.feedback.has_value() || o.feedback_window || o.feedback_bandwidth), "--feedback", "iicv"},
      {is_iduw && o.k.has_value(), "--k", "iicv and cv-baseline"},
      {is_iduw && o.ridge.has_value(), "--ridge", "iicv and cv-baseline"},
      {is_iduw && o.exclude_target, "--exclude-target", "iicv and cv-baseline"},
      {is_iduw && !o.coefficients.empty(), "--coefficients", "iicv and cv-baseline"},
      {is_iduw && o.error, "--error", "iicv and cv-baseline"},
      {!is_iduw && o.samples.has_value(), "--samples", "iduw"}};
  for (const auto& [given, option, estimator] : wrong)
    if (given) usage(fmt::format("{} is an option of --estimator {}, not of {}", option, estimator, o.estimator));
}

/// What the files themselves tell: sizes, kinds of sampling, precision.
void check_files(const GroupedFile& crn, const GroupedFile& pt, std::vector<Finding>& findings) {
  using Severity = Finding::Severity;
  const auto size = [](const GroupedFile& f) {
    const CropWindow& w = f.place().window;
    return fmt::format("{} x {} pixels at ({}, {}) of {} x {}", w.width, w.height, w.x, w.y, f.place().frame_width,
                       f.place().frame_height);
  };
  if (!(crn.place() == pt.place()))
    throw Error(ErrorCode::kInput, fmt::format("{} has {}, {} has {}; both images must show the same pixels",
                                               crn.name(), size(crn), pt.name(), size(pt)));
  if (crn.sampling() == "independent" || pt.sampling() == "crn")
    findings.push_back({Severity::kError, "the files say that CRN was rendered with sampling '" + crn.sampling() +
                                              "' and PT with '" + pt.sampling() +
                                              "'; expected are --sampling crn and --sampling independent"});
  if (!crn.scene_hash().empty() && !pt.scene_hash().empty() && crn.scene_hash() != pt.scene_hash())
    findings.push_back({Severity::kError, "the files say that they show different scenes (attribute scene_hash)"});
  if (!crn.settings().empty() && !pt.settings().empty() && crn.settings() != pt.settings())
    findings.push_back({Severity::kError, "the files say that they were rendered with different settings: CRN with '" +
                                              crn.settings() + "', PT with '" + pt.settings() + "'"});
  for (const auto& [name, file] : {std::pair{"CRN", &crn}, {"PT", &pt}})
    if (file->has_half())
      findings.push_back(
          {Severity::kWarning,
           fmt::format(
               "{}: values have 16 bits, which limits what can be gained; save 32-bit float values: in Mitsuba "
               "component_format \"float32\", in pbrt Film \"bool savefp16\" false, in Blender color_depth = '32'",
               name)});
}

class Stopwatch {
 public:
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    const double seconds = std::chrono::duration<double>(now - last_).count();
    last_ = now;
    return seconds;
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

/// Both images, some rows at a time.
class Bands {
 public:
  Bands(const GroupedFile& crn, const GroupedFile& pt, double memory_mib) : crn_(crn), pt_(pt) {
    // The values themselves, and about 40 floats per pixel that an estimator works with.
    const double row_bytes = crn.width() * (12.0 * (crn.groups() + pt.groups()) + 160);
    rows_ = static_cast<int>(std::min<double>(crn.height(), memory_mib * 1048576 / row_bytes));
  }
  /// Rows that fit in memory at once.
  int rows() const { return rows_; }
  void read(int first, int n) {
    if (first == first_ && n == n_) return;
    crn_.read_rows(first, n, crn_data_);
    pt_.read_rows(first, n, pt_data_);
    first_ = first;
    n_ = n;
  }
  GroupedImage crn() const { return {crn_.width(), n_, crn_.groups(), crn_data_.data()}; }
  GroupedImage pt() const { return {pt_.width(), n_, pt_.groups(), pt_data_.data()}; }

 private:
  const GroupedFile &crn_, &pt_;
  int rows_, first_ = -1, n_ = 0;
  std::vector<float> crn_data_, pt_data_;
};

InputReport examine(const GroupedFile& crn, const GroupedFile& pt, Bands& bands) {
  InputDoctor doctor(crn.width(), crn.height(), crn.groups(), pt.groups());
  const int step = std::max(16, bands.rows());
  for (int y = 0; y < crn.height(); y += step) {
    bands.read(y, std::min(step, crn.height() - y));
    doctor.add_rows(bands.crn(), bands.pt());
  }
  return doctor.report();
}

EstimatorResult estimate(const Method& method, const GroupedFile& file, Bands& bands) {
  const int height = file.height();
  if (method.reach < 0 || bands.rows() >= height) {
    bands.read(0, height);
    return method.apply(bands.crn(), bands.pt());
  }
  // Bands begin at even rows, because the feedback works on cells of two rows.
  const int step = std::max(16, bands.rows() - 2 * method.reach) / 2 * 2;
  EstimatorResult whole;
  for (int y = 0; y < height; y += step) {
    const int first = std::max(0, y - method.reach) / 2 * 2, last = std::min(height, y + step + method.reach);
    bands.read(first, last - first);
    const EstimatorResult part = method.apply(bands.crn(), bands.pt());
    // Counts pixels in the overlap of two bands twice; a number above zero is what matters.
    whole.nonfinite_pixels += part.nonfinite_pixels;
    const auto append = [&](const Image& from, Image& to) {
      if (from.data.empty()) return;
      if (to.data.empty()) to = Image(from.width, height, 3);
      std::copy_n(from.pixel(0, y - first), static_cast<size_t>(from.width) * 3 * (std::min(height, y + step) - y),
                  to.pixel(0, y));
    };
    append(part.estimate, whole.estimate);
    append(part.std_error, whole.std_error);
  }
  return whole;
}

void write(const CombineOptions& o, const GroupedFile& crn, const GroupedFile& pt, EstimatorResult& result) {
  std::map<std::string, std::string> attributes = {{"covary:estimator", o.estimator + (o.paper ? " --paper" : "")},
                                                   {"covary:version", COVARY_VERSION},
                                                   {"covary:command", command_line()}};
  if (crn.samples() && pt.samples()) attributes["covary:samples"] = fmt::to_string(crn.samples() + pt.samples());
  std::vector<ExrPlane> planes;
  for (size_t c = 0; c < 3; ++c)
    planes.push_back({std::string(1, "RGB"[c]), ExrPlane::Type::kFloat, result.estimate.data.data() + c, 12});
  if (!result.std_error.data.empty())
    for (size_t c = 0; c < 3; ++c)
      planes.push_back(
          {fmt::format("StdError.{}", "RGB"[c]), ExrPlane::Type::kFloat, result.std_error.data.data() + c, 12});
  write_exr(o.output, crn.place(), attributes, planes);
}

nlohmann::ordered_json json_of(const Correlation& c) {
  if (c.pairs == 0) return nullptr;
  return {{"value", c.value}, {"standard_error", c.standard_error}, {"pairs", c.pairs}};
}

void combine(const CombineOptions& o) {
  check_options(o);
  std::optional<tbb::global_control> control;
  if (o.threads > 0) control.emplace(tbb::global_control::max_allowed_parallelism, o.threads);
  Stopwatch watch;
  const GroupedFile crn(o.crn, o.crn_layer), pt(o.pt, o.pt_layer);
  const Method method = o.estimator == "iicv"          ? make_iicv(o)
                        : o.estimator == "cv-baseline" ? make_cv_baseline(o)
                                                       : make_iduw(o, crn);
  throw_if_any(o.estimator, method.problems);

  std::vector<Finding> findings;
  check_files(crn, pt, findings);
  Bands bands(crn, pt, o.memory_mib);
  const InputReport report = examine(crn, pt, bands);
  findings.insert(findings.end(), report.findings.begin(), report.findings.end());
  std::string errors;
  for (const Finding& f : findings)
    if (f.severity == Finding::Severity::kError && !o.force) errors += (errors.empty() ? "" : "; ") + f.text;
  if (!errors.empty())
    throw Error(ErrorCode::kInput, "the inputs do not fit: " + errors + " (--force combines them nevertheless)");
  for (const Finding& f : findings) {
    const bool note = f.severity == Finding::Severity::kNote;
    if (!note || !o.quiet) std::fprintf(stderr, "%s: %s\n", note ? "note" : "warning", f.text.c_str());
  }
  const double check_seconds = watch.lap();

  EstimatorResult result = estimate(method, crn, bands);
  const double estimate_seconds = watch.lap();
  write(o, crn, pt, result);
  const double write_seconds = watch.lap();

  if (!o.quiet)
    std::fprintf(stderr, "%s: %d x %d, %s of %d + %d groups in %.2f s (read and check %.2f s, write %.2f s)\n",
                 o.output.c_str(), crn.width(), crn.height(), o.estimator.c_str(), crn.groups(), pt.groups(),
                 estimate_seconds, check_seconds, write_seconds);
  if (o.json.empty()) return;
  nlohmann::ordered_json json = {
      {"output", o.output},
      {"estimator", o.estimator},
      {"width", crn.width()},
      {"height", crn.height()},
      {"crn_groups", crn.groups()},
      {"pt_groups", pt.groups()},
      {"nonfinite_pixels", result.nonfinite_pixels},
      {"rank_correlation",
       {{"crn_horizontal", json_of(report.crn_horizontal)},
        {"crn_vertical", json_of(report.crn_vertical)},
        {"pt_horizontal", json_of(report.pt_horizontal)},
        {"pt_vertical", json_of(report.pt_vertical)},
        {"crn_pt", json_of(report.crn_pt)}}},
      {"mean", {{"crn", report.crn_mean}, {"pt", report.pt_mean}}},
      {"seconds", {{"read_and_check", check_seconds}, {"estimate", estimate_seconds}, {"write", write_seconds}}}};
  if (o.json == "-")
    std::fputs((json.dump(2) + "\n").c_str(), stdout);
  else
    write_text_file(o.json, json.dump(2) + "\n");
}

}  // namespace

void add_combine(CLI::App& app) {
  const auto o = std::make_shared<CombineOptions>();
  CLI::App* command =
      app.add_subcommand("combine", "Combine a CRN and an independent image of any renderer into one with less noise");
  command->add_option("--crn", o->crn, "Image with common random numbers: one EXR with all groups, or one per group")
      ->required()
      ->expected(1, 1000);
  command->add_option("--pt", o->pt, "Image with independent random numbers, likewise")->required()->expected(1, 1000);
  command->add_option("-o,--output", o->output, "The result (EXR)")->required();
  command->add_option("--crn-layer", o->crn_layer, "Layer of the CRN image where its files hold several");
  command->add_option("--pt-layer", o->pt_layer, "Layer of the PT image where its files hold several");
  command->add_option("--estimator", o->estimator, "iicv, or a comparator")
      ->check(CLI::IsMember({"iicv", "cv-baseline", "iduw"}))
      ->capture_default_str();
  command->add_flag("--paper", o->paper, "iicv as published: no sample share, no conservation, no feedback");
  command->add_option("--k", o->k, "Number of control variates; default 25");
  command->add_option("--window", o->window, "Side of the window they are chosen from; default 11 (iduw: 15)");
  const std::map<std::string, Penalty> penalties = {{"pilot", Penalty::kPilot},
                                                    {"sample", Penalty::kSample},
                                                    {"smoothed", Penalty::kSmoothed},
                                                    {"homogeneous", Penalty::kHomogeneous},
                                                    {"cross-fit", Penalty::kCrossFit}};
  command
      ->add_option("--penalty,--variance", o->penalty,
                   "Error of the PT pixels: pilot, sample, smoothed, homogeneous or cross-fit; default pilot")
      ->transform(CLI::CheckedTransformer(penalties).description(""))
      ->type_name("NAME");
  command->add_option("--pilot-window", o->pilot_window, "Side of the pilot's window; default 11");
  command->add_option("--ridge", o->ridge,
                      "Factor of the homogeneous penalty (default 1), or ridge of cv-baseline (0)");
  command->add_flag("--asymmetric", o->asymmetric, "Penalty of the neighbour alone, not averaged with the target's");
  command->add_flag("--exclude-target", o->exclude_target, "Leave the target out of its own control variates");
  command->add_option("--coefficients", o->coefficients, "One coefficient for all channels, or one per channel")
      ->check(CLI::IsMember({"shared", "per-channel"}));
  command->add_option("--sample-share", o->sample_share,
                      "Part of the penalty that is the sample variance; default 0.5");
  command->add_option("--conservation", o->conservation, "Weight of the condition sum beta g = f; default 30");
  command->add_option("--feedback", o->feedback, "on or off: give back what the penalty takes away; default on")
      ->transform(CLI::CheckedTransformer(std::map<std::string, bool>{{"on", true}, {"off", false}}).description(""))
      ->type_name("on|off");
  command->add_option("--feedback-window", o->feedback_window, "Side of the feedback's window; default 41");
  command->add_option("--feedback-bandwidth", o->feedback_bandwidth, "Bandwidth in standard errors; default 5");
  command->add_option("--samples", o->samples,
                      "iduw: samples per pixel of the CRN image; default: what its file tells");
  command->add_flag("--error", o->error, "Add the standard error as channels StdError.R, .G, .B");
  command->add_flag("--force", o->force, "Combine even where the check of the inputs finds errors");
  command
      ->add_option("--memory", o->memory_mib,
                   "MiB to work in: larger images are worked on in bands, with the same bits")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("--threads", o->threads, "Number of threads; default: all")->check(CLI::Range(1, 4096));
  command->add_option("--json", o->json, "File for statistics; '-': standard output");
  command->add_flag("--quiet", o->quiet, "Warnings and errors only");
  command->callback([o] { combine(*o); });
}

}  // namespace covary
