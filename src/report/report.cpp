// SPDX-License-Identifier: Apache-2.0
#include "report/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <thread>

#include "core/error.h"
#include "core/parallel.h"
#include "imageio/output_file.h"
#include "metrics/error_map.h"
#include "report/embedded.h"
#include "report/image_block.h"

namespace covary {
namespace {

using Json = nlohmann::ordered_json;

void append(std::string& text, std::initializer_list<std::string_view> parts) {
  for (const std::string_view part : parts) text += part, text += '\n';
}

/// Replaces invalid UTF-8, e.g. in a file name, by replacement characters.
std::string valid_utf8(const std::string& text) {
  return Json::parse(Json(text).dump(-1, ' ', false, Json::error_handler_t::replace)).get<std::string>();
}

std::string escaped_html(const std::string& text) {
  std::string result;
  for (const char c : valid_utf8(text)) switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        result += c;
    }
  return result;
}

/// JSON safe inside a <script>: no '<', so nothing can close the element or open a comment. Invalid UTF-8, e.g. in a
/// file name, becomes replacement characters.
std::string script_json(const Json& json) {
  std::string result;
  for (const char c : json.dump(-1, ' ', false, Json::error_handler_t::replace)) {
    if (c == '<')
      result += "\\u003c";
    else
      result += c;
  }
  return result;
}

/// Width, height and channels of each image, by id.
using Sizes = std::map<std::string, std::array<int, 3>>;

void check_block(const Json& block, const Sizes& sizes) {
  const std::string type = block.value("type", "");
  constexpr std::array kTypes{"table", "plot", "comparer", "notes"};
  COVARY_CHECK(std::find(kTypes.begin(), kTypes.end(), type) != kTypes.end(), "unknown block type '" + type + "'");
  if (type != "comparer") return;
  for (const Json& scene : block.at("scenes")) {
    std::set<std::pair<int, int>> scene_sizes;
    const auto take = [&](const Json& id_json) {
      const auto& id = id_json.get_ref<const std::string&>();
      COVARY_CHECK(sizes.contains(id), "the document names an image '" + id + "' that is not there");
      const auto [width, height, channels] = sizes.at(id);
      scene_sizes.insert({width, height});
      return channels;
    };
    for (const Json& image : scene.at("images")) {
      COVARY_CHECK(take(image.at("image")) == 3, "an image of a comparer does not have 3 channels");
      if (image.contains("flip")) take(image["flip"]);
      for (const Json& layer : image.value("layers", Json::array())) take(layer.at("image"));
    }
    COVARY_CHECK(scene_sizes.size() == 1, "a scene of a comparer needs images, all of one size");
  }
}

void check(const Json& document, const std::vector<ReportImage>& images) {
  Sizes sizes;
  for (const ReportImage& image : images) {
    const std::array size{image.pixels.width, image.pixels.height, image.pixels.channels};
    COVARY_CHECK(sizes.emplace(image.id, size).second, "two images are called '" + image.id + "'");
    COVARY_CHECK(image.pixels.channels == 1 || image.pixels.channels == 3,
                 "image '" + image.id + "' has neither 1 nor 3 channels");
  }
  for (const Json& section : document.value("sections", Json::array()))
    for (const Json& block : section.value("blocks", Json::array())) check_block(block, sizes);
}

std::string styles(std::string_view own = "") {
  std::string text;
  append(text, {report_files::page_css, report_files::comparer_css, own});
  return text;
}

/// All scripts wrapped in one function to keep their names out of the page's global scope; later files use earlier
/// ones.
std::string scripts(std::string_view main) {
  using namespace report_files;
  std::string text;
  append(text, {"(() => {", "\"use strict\";", dom_js,     format_js,   images_js,   tone_js,     colour_js,
                ssim_js,    views_js,          link_js,    viewport_js, painter_js,  stage_js,    insets_js,
                figure_js,  histogram_js,      readout_js, frames_js,   controls_js, gestures_js, comparer_js,
                table_js,   plot_js,           main,       "})();"});
  return text;
}

/// page.html with each {{name}} substituted.
std::string fill_page(const std::string& title, Json document, const std::string& styles, const std::string& scripts) {
  document["error_colours"] = error_colours();
  const std::array<std::pair<std::string_view, std::string>, 6> values{{
      {"title", escaped_html(title)},
      {"styles", styles},
      {"licence", std::string(report_files::chart_licence_txt)},
      {"library", std::string(report_files::chart_min_js)},
      {"document", script_json(document)},
      {"scripts", scripts},
  }};
  const std::string_view page = report_files::page_html;
  std::string text;
  size_t position = 0;
  while (true) {
    const size_t begin = page.find("{{", position);
    text += page.substr(position, begin - position);
    if (begin == std::string_view::npos) return text;
    const size_t end = page.find("}}", begin);
    const std::string_view name = page.substr(begin + 2, end - begin - 2);
    const auto* value = std::find_if(values.begin(), values.end(), [&](const auto& v) { return v.first == name; });
    COVARY_CHECK(value != values.end(), fmt::format("page.html asks for '{}'", name));
    text += value->second;
    position = end + 2;
  }
}

std::string image_element(const ReportImage& image) {
  return fmt::format("<script type=\"application/octet-stream\" data-image=\"{}\">{}</script>\n",
                     escaped_html(image.id), encode_image(image.pixels));
}

/// Images come last, so that a browser shows the page while they are still loading.
void write_images(OutputFile& file, const std::vector<ReportImage>& images) {
  const size_t at_once = std::max(1u, std::thread::hardware_concurrency());
  std::vector<std::string> elements(at_once);
  for (size_t first = 0; first < images.size(); first += at_once) {
    const size_t n = std::min(at_once, images.size() - first);
    parallel_for(n, [&](size_t i) { elements[i] = image_element(images[first + i]); });
    for (size_t i = 0; i < n; ++i) file.write(elements[i].data(), elements[i].size());
  }
}

}  // namespace

void write_report(const std::string& path, const Json& document, const std::vector<ReportImage>& images) {
  check(document, images);
  OutputFile file(path);
  Json data = document;
  data["image_sizes"] = Json::object();
  for (const auto& [id, pixels] : images) data["image_sizes"][id] = {pixels.width, pixels.height, pixels.channels};
  const std::string page = fill_page(document.value("title", "covary"), data, styles(), scripts(report_files::page_js));
  file.write(page.data(), page.size());
  write_images(file, images);
  file.commit();
}

std::string script_page(const std::string& title, std::string_view own_styles, std::string_view script) {
  return fill_page(title, Json::object(), styles(own_styles), scripts(script));
}

}  // namespace covary
