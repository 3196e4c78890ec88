// SPDX-License-Identifier: Apache-2.0
#include "papers/paper_report.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace covary::lab {
namespace {

using Json = nlohmann::ordered_json;

/// Puts `prefix` before the ids of comparers and of their images.
void rename_pictures(const std::string& prefix, Json& block) {
  if (block["type"] != "comparer") return;
  const auto rename = [&](Json& object, const char* member) {
    if (object.contains(member)) object[member] = prefix + object[member].get<std::string>();
  };
  rename(block, "id");
  for (Json& scene : block["scenes"])
    for (Json& image : scene["images"]) rename(image, "image"), rename(image, "flip");
}

size_t values_of(const std::vector<ReportImage>& pictures) {
  size_t n = 0;
  for (const ReportImage& picture : pictures) n += picture.pixels.data.size();
  return n;
}

std::vector<std::string> names_of(const std::vector<SceneEntry>& scenes) {
  std::vector<std::string> names;
  for (const SceneEntry& scene : scenes) names.push_back(scene.name);
  return names;
}

/// What a part's scenes are, if not the paper's.
std::vector<std::string> notes_of(const PreparedPart& part) {
  std::vector<std::string> notes;
  if (part.own_scenes)
    notes.push_back(
        "None of the scenes of this part is at hand: scenes of covary in their place, so that no number is "
        "comparable with the paper's.");
  if (!part.missing.empty())
    notes.push_back(fmt::format("Missing scenes: {}.", fmt::join(names_of(part.missing), ", ")));
  return notes;
}

Json column(const char* key, const char* title) { return {{"key", key}, {"title", title}, {"kind", "text"}}; }

}  // namespace

void PaperReport::add(const PreparedPart& part, const Results& results, Json document,
                      std::vector<ReportImage> pictures) {
  const std::string& id = part.part.names[0];
  std::vector<std::string> published = part.part.published;
  for (std::string& text : published) text = "Published: " + text;
  Json head{{"id", id}, {"heading", part.part.title}, {"text", published}, {"blocks", Json::array()}};
  if (const auto notes = notes_of(part); !notes.empty())
    head["blocks"].push_back({{"type", "notes"}, {"kind", "warning"}, {"items", notes}});
  const size_t n_values = values_of(pictures);
  const bool with_pictures = picture_values_ + n_values <= kMaxPictureValues;
  if (!with_pictures) head["text"].push_back(fmt::format("Pictures: on the page of this part, `{}/report.html`.", id));
  sections_.push_back(std::move(head));
  for (Json& section : document["sections"]) {
    const bool is_pictures = section["id"] == "images";
    if (is_pictures && !with_pictures) continue;
    section["id"] = id + "-" + section["id"].get<std::string>();
    section["heading"] = fmt::format("{}: {}", id, section["heading"].get<std::string>());
    for (Json& block : section["blocks"]) rename_pictures(id + "-", block);
    sections_.push_back(std::move(section));
  }
  if (with_pictures) {
    picture_values_ += n_values;
    for (ReportImage& picture : pictures) {
      picture.id = id + "-" + picture.id;
      pictures_.push_back(std::move(picture));
    }
  }
  meta_ = Json::array();
  for (const Json& pair : document["meta"])
    if (const std::string name = pair[0]; name == "Version" || name == "Date" || name == "Machine" || name == "Command")
      meta_.push_back(pair);
  rows_.push_back(
      {{"part", {{"value", part.part.title}, {"link", "#" + id}}},
       {"suite", results.suite.name},
       {"scenes", fmt::format("{}{}", part.own_scenes ? "own: " : "", fmt::join(names_of(results.suite.scenes), ", "))},
       {"missing", fmt::format("{}", part.missing.size())},
       {"failures", fmt::format("{}", results.failures.size())},
       {"page", {{"value", id}, {"link", id + "/report.html"}}}});
  parts_.push_back({{"names", part.part.names},
                    {"title", part.part.title},
                    {"published", part.part.published},
                    {"missing", names_of(part.missing)},
                    {"own_scenes", part.own_scenes},
                    {"results", to_json(results)}});
}

Json PaperReport::document() const {
  Json contents{{"id", "parts"}, {"heading", "Parts"}, {"text", Json::array()}};
  contents["blocks"].push_back(
      {{"type", "table"},
       {"caption", "What this page has; each part has a page and data of its own, too"},
       {"columns",
        {column("part", "Part"), column("suite", "Suite"), column("scenes", "Scenes"), column("missing", "Missing"),
         column("failures", "Failures"), column("page", "Page")}},
       {"rows", rows_}});
  Json sections = Json::array({contents});
  for (const Json& section : sections_) sections.push_back(section);
  return {{"title", paper_.title}, {"subtitle", paper_.description}, {"meta", meta_}, {"sections", sections}};
}

Json PaperReport::data() const {
  return {{"format", std::string(kResultsFormat) + "-paper"}, {"paper", paper_.name}, {"parts", parts_}};
}

}  // namespace covary::lab
