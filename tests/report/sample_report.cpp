// SPDX-License-Identifier: Apache-2.0
// sample_report OUT.html: a report with every kind of block, whose images have values that report_test.py can predict.
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <string>

#include "report/report.h"

namespace covary {
namespace {

using Json = nlohmann::ordered_json;
constexpr int kWidth = 64, kHeight = 32;

/// One channel: x / 64.
Image across() {
  Image image(kWidth, kHeight, 1);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) *image.pixel(x, y) = static_cast<float>(x) / 64;
  return image;
}

Image image_of(const std::function<Spectrum(int, int)>& value) {
  Image image(kWidth, kHeight, 3);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const Spectrum rgb = value(x, y);
      float* pixel = image.pixel(x, y);
      pixel[0] = rgb.r, pixel[1] = rgb.g, pixel[2] = rgb.b;
    }
  return image;
}

/// Multiples of 1/64, which half floats hold exactly.
Spectrum ramp(int x, int y) { return {static_cast<float>(x) / 64, static_cast<float>(y) / 64, 0.25f}; }

std::vector<ReportImage> images() {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  return {
      {"ramp/reference", image_of(ramp)},
      {"ramp/bright", image_of([](int x, int y) { return ramp(x, y) + Spectrum(0.125f); })},
      {"ramp/dark", image_of([](int x, int y) { return ramp(x, y) - Spectrum(0.0625f); })},
      {"ramp/broken", image_of([&](int x, int y) { return x < 8 && y < 8 ? Spectrum(nan) : ramp(x, y); })},
      {"ramp/bright:FLIP", across()},
      {"ramp/bright:StdError", image_of([](int, int) { return Spectrum(0.125f); })},
      {"ramp/bright:N", image_of([](int x, int) {
         return Spectrum{0, x < 32 ? -1.f : 1.f, 0.5f};
       })},
      {"ramp/bright:samples", across()},
      {"stripes/reference", image_of([](int x, int) { return Spectrum(x % 2 ? 1.f : 0.f); })},
      {"stripes/bright", image_of([](int, int) { return Spectrum(0.5f); })},
      {"stripes/white", image_of([](int, int) { return Spectrum(4); })},
  };
}

Json comparer() {
  const auto entry = [](const std::string& scene, const std::string& name, const std::string& label) {
    return Json{{"name", name}, {"image", scene + "/" + name}, {"label", label}};
  };
  Json reference = entry("ramp", "reference", "reference"), stripes = entry("stripes", "reference", "reference");
  reference["role"] = stripes["role"] = "reference";
  Json dark = entry("ramp", "dark", "relMSE 0.02");
  dark["role"] = "baseline";
  Json bright = entry("ramp", "bright", "relMSE 0.09"), white = entry("stripes", "white", "relMSE 9");
  bright["flip"] = "ramp/bright:FLIP";
  bright["layers"] = {{{"name", "StdError"}, {"image", "ramp/bright:StdError"}},
                      {{"name", "N"}, {"image", "ramp/bright:N"}, {"display", "direction"}},
                      {{"name", "samples"}, {"image", "ramp/bright:samples"}, {"display", "range"}}};
  white["role"] = "best";
  return {{"type", "comparer"},
          {"id", "main"},
          {"scenes",
           {{{"name", "ramp"},
             {"credit", "Made for a test."},
             {"images", {reference, bright, dark, entry("ramp", "broken", "relMSE 0")}},
             {"insets", {{{"x", 8}, {"y", 8}, {"w", 16}, {"h", 8}}}}},
            {{"name", "stripes & more"}, {"images", {stripes, entry("stripes", "bright", "relMSE 1"), white}}}}}};
}

Json table() {
  return {{"type", "table"},
          {"caption", "Errors"},
          {"columns",
           {{{"key", "method"}, {"title", "Method"}, {"kind", "text"}},
            {{"key", "error"}, {"title", "relMSE"}, {"kind", "number"}, {"better", "low"}},
            {{"key", "gain"}, {"title", "Gain"}, {"kind", "ratio"}, {"digits", 2}, {"better", "high"}},
            {{"key", "time"}, {"title", "Time"}, {"kind", "seconds"}},
            {{"key", "share"}, {"title", "Bias"}, {"kind", "percent"}, {"digits", 2}}}},
          {"rows",
           {{{"method", "path tracing"}, {"error", 0.034}, {"gain", 1}, {"time", 12.25}, {"share", nullptr}},
            {{"method", {{"value", "IICV"}, {"link", "#view=main/ramp/bright/reference&mode=error"}}},
             {"error", {{"value", 0.0037}, {"low", 0.0035}, {"high", 0.0039}}},
             {"gain", 9.2},
             {"time", 150},
             {"share", 0.04}},
            {{"method", "IDUW"},
             {"error", {{"value", 0.0088}, {"note", "published 0.0088"}}},
             {"gain", 3.9},
             {"time", nullptr},
             {"share", 0.11}}}}};
}

/// The best method of each scene.
Json grouped_table() {
  const auto row = [](const char* scene, const char* method, double error) {
    return Json{{"scene", scene}, {"method", method}, {"error", error}, {"samples", 2}};
  };
  return {{"type", "table"},
          {"best_within", "scene"},
          {"columns",
           {{{"key", "scene"}, {"title", "Scene"}, {"kind", "text"}},
            {{"key", "method"}, {"title", "Method"}, {"kind", "text"}},
            {{"key", "error"}, {"title", "relMSE"}, {"kind", "number"}, {"better", "low"}},
            {{"key", "samples"}, {"title", "Samples"}, {"kind", "number"}}}},
          {"rows",
           {row("a", "m", 1.5), row("a", "n", 0.5), row("b", "m", 3.5), row("b", "n", 4.5), row("c", "m", 7.3e-5)}}};
}

Json plots() {
  const std::vector<double> spp{48, 96, 192, 384};
  const Json convergence{{"type", "plot"},
                         {"title", "Convergence"},
                         {"x", {{"label", "samples per pixel"}, {"scale", "log"}}},
                         {"y", {{"label", "relMSE"}, {"scale", "log"}}},
                         {"series",
                          {{{"name", "path tracing"},
                            {"x", spp},
                            {"y", {0.14, 0.07, 0.034, 0.017}},
                            {"low", {0.1, 0.05, 0.03, 0.015}},
                            {"high", {0.18, 0.09, 0.04, 0.02}}},
                           {{"name", "IICV"}, {"x", spp}, {"y", {0.015, 0.0072, 0.0037, nullptr}}},
                           {{"name", "slope −1"}, {"x", {48, 384}}, {"y", {0.1, 0.0125}}, {"style", "dashed"}}}},
                         {"alt", "relMSE falls with the number of samples; IICV lies nine times below path tracing."}};
  const Json bars{{"type", "plot"},
                  {"title", "Time"},
                  {"x", {{"label", ""}, {"scale", "category"}}},
                  {"y", {{"label", "seconds"}, {"scale", "linear"}}},
                  {"series",
                   {{{"name", "IICV"},
                     {"x", {"render", "estimate"}},
                     {"y", {12.0, 1.5}},
                     {"low", {10.0, 1.2}},
                     {"high", {19.0, 1.9}},
                     {"style", "bars"}}}},
                  {"alt", "Rendering takes most of the time."}};
  return {convergence, bars};
}

Json many_warnings() {
  Json items = Json::array();
  for (int i = 1; i <= 8; ++i) items.push_back("warning " + std::to_string(i));
  return {{"type", "notes"}, {"kind", "warning"}, {"items", items}};
}

Json document() {
  return {{"title", "Sample report"},
          {"subtitle", "Every kind of block </script> once"},
          {"meta", {{"machine", "none"}, {"commit", "0"}}},
          {"sections",
           {{{"id", "results"},
             {"heading", "Results"},
             {"text", {"Text <b>as it is</b>, `code --apart`."}},
             {"blocks", {table(), plots()[0], plots()[1]}}},
            {{"id", "images"}, {"heading", "Images"}, {"blocks", {comparer()}}},
            {{"id", "failures"},
             {"heading", "Failures"},
             {"blocks",
              {{{"type", "notes"}, {"kind", "error"}, {"items", {"a scene failed"}}},
               many_warnings(),
               grouped_table()}}}}}};
}

}  // namespace
}  // namespace covary

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("usage: sample_report OUT.html\n", stderr);
    return 2;
  }
  covary::write_report(argv[1], covary::document(), covary::images());
  return 0;
}
