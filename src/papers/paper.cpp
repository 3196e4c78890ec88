// SPDX-License-Identifier: Apache-2.0
#include "papers/paper.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include "core/error.h"
#include "core/known_names.h"
#include "lab/located_json.h"

namespace covary::lab {
namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;

constexpr int64_t kMax = 1'000'000'000;

// ---- reading

/// Limits that replace those of `limits`.
QuickLimits quick_limits(const LocatedJson& document, const std::string& pointer, QuickLimits limits, Words& problems) {
  ObjectReader reader(document, pointer, problems);
  const auto whole = [&](const char* name, auto& value) {
    if (const auto found = reader.whole(name, 1, kMax)) value = static_cast<std::decay_t<decltype(value)>>(*found);
  };
  whole("seeds", limits.seeds), whole("spp", limits.spp), whole("reference_spp", limits.reference_spp);
  whole("pixels", limits.pixels), whole("crop_pixels", limits.crop_pixels), whole("sized_pixels", limits.sized_pixels);
  whole("scenes", limits.scenes);
  if (const auto seconds = reader.positive("seconds")) limits.seconds = *seconds;
  if (Words methods = reader.texts("methods"); !methods.empty()) limits.methods = std::move(methods);
  reader.finish();
  return limits;
}

Suite builtin_suite(const std::string& name) {
  return parse_suite(std::string(builtin_suites().at(name)), name + ".json");
}

/// The name of a built-in suite.
std::string suite_name(ObjectReader& reader, const char* member) {
  const std::string name = reader.required_text(member);
  if (!name.empty() && !builtin_suites().contains(name)) reader.problem(member, "no suite is named '" + name + "'");
  return name;
}

PaperPart read_part(const LocatedJson& document, const std::string& pointer, const QuickLimits& quick,
                    Words& problems) {
  ObjectReader reader(document, pointer, problems);
  PaperPart part;
  part.names = reader.texts("names");
  if (part.names.empty()) reader.problem("", "lacks 'names', a list of texts");
  part.title = reader.required_text("title");
  part.suite = suite_name(reader, "suite");
  part.seconds = reader.positive("seconds").value_or(0);
  part.published = reader.texts("published");
  const auto own = reader.object("quick");
  part.quick = own ? quick_limits(document, *own, quick, problems) : quick;
  reader.finish();
  return part;
}

// ---- choosing

std::vector<PaperPart> chosen(const Paper& paper, const Words& only) {
  Words known;
  for (const PaperPart& part : paper.parts) known.insert(known.end(), part.names.begin(), part.names.end());
  for (const std::string& name : only)
    if (std::find(known.begin(), known.end(), name) == known.end())
      throw Error(ErrorCode::kUsage, fmt::format("--only: '{}' has no part '{}'", paper.name, name) +
                                         hint_and_list(name, known, fmt::format("it has {}", fmt::join(known, ", "))));
  std::vector<PaperPart> parts;
  for (const PaperPart& part : paper.parts)
    if (only.empty() ||
        std::find_first_of(only.begin(), only.end(), part.names.begin(), part.names.end()) != only.end())
      parts.push_back(part);
  return parts;
}

/// The names that entries of the suite have. Those found are added to `found`.
template <typename Entry>
Words of_suite(const Words& names, const std::vector<Entry>& entries, std::set<std::string>& found) {
  Words own;
  for (const std::string& name : names)
    if (std::any_of(entries.begin(), entries.end(), [&](const Entry& e) { return e.name == name; }))
      own.push_back(name), found.insert(name);
  return own;
}

void throw_if_unknown(const char* what, const Words& names, const std::set<std::string>& found) {
  for (const std::string& name : names)
    if (!found.contains(name))
      throw Error(ErrorCode::kUsage, fmt::format("no part of the paper has a {} '{}'", what, name));
}

/// Own scenes, in each layer that the suite measures, with nothing published about them.
void replace_scenes(const std::string& own_suite, const std::string& own_folder, Suite& suite) {
  Words layers;
  for (const SceneEntry& scene : suite.scenes)
    if (std::find(layers.begin(), layers.end(), scene.layer) == layers.end()) layers.push_back(scene.layer);
  suite.scenes.clear();
  for (SceneEntry scene : builtin_suite(own_suite).scenes)
    for (const std::string& layer : layers) {
      SceneEntry& added = suite.scenes.emplace_back(scene);
      added.layer = layer;
      added.file = (fs::path(own_folder) / scene.file).string();
      if (!layer.empty()) added.name += ", " + layer;
    }
  suite.published_source.clear(), suite.published_relmse.clear(), suite.published_ratio.clear();
}

/// Finds the part's scenes.
void locate(const Paper& paper, const std::string& folder, const std::string& own_folder, PreparedPart& prepared) {
  Suite& suite = prepared.suite;
  std::vector<SceneEntry> here;
  for (SceneEntry scene : suite.scenes) {
    const fs::path given = fs::path(folder) / scene.file, own = fs::path(own_folder) / scene.file;
    const bool is_given = !folder.empty() && fs::exists(given);
    if (!is_given && !fs::exists(own)) {
      prepared.missing.push_back(scene);
      continue;
    }
    scene.file = fs::absolute(is_given ? given : own).lexically_normal().string();
    here.push_back(std::move(scene));
  }
  prepared.own_scenes = here.empty();
  if (here.empty())
    replace_scenes(paper.own_scenes, own_folder, suite);
  else
    suite.scenes = std::move(here);
}

}  // namespace

Paper parse_paper(const std::string& text, const std::string& name) {
  const LocatedJson document = parse_located(text, name);
  Words problems;
  ObjectReader reader(document, "", problems);
  Paper paper;
  paper.name = reader.required_text("name");
  paper.title = reader.required_text("title");
  paper.description = reader.text("description").value_or("");
  paper.own_scenes = suite_name(reader, "own_scenes");
  const auto own = reader.object("quick");
  const QuickLimits quick = own ? quick_limits(document, *own, {}, problems) : QuickLimits{};
  for (const std::string& part : reader.objects("parts"))
    paper.parts.push_back(read_part(document, part, quick, problems));
  if (paper.parts.empty()) reader.problem("parts", "a paper has at least one part");
  reader.finish();
  std::set<std::string> names;
  for (const PaperPart& part : paper.parts)
    for (const std::string& own_name : part.names)
      if (!names.insert(own_name).second) reader.problem("parts", "two parts have the name '" + own_name + "'");
  if (!problems.empty()) throw Error(ErrorCode::kInput, fmt::format("{}", fmt::join(problems, "\n")));
  return paper;
}

std::vector<PreparedPart> prepare_parts(const Paper& paper, const Words& only, const std::string& folder,
                                        const std::string& own_folder, const Overrides& overrides) {
  std::vector<PreparedPart> parts;
  std::set<std::string> scenes, methods, missing;
  for (const PaperPart& part : chosen(paper, only)) {
    PreparedPart prepared{part, builtin_suite(part.suite), {}, false};
    if (part.seconds > 0) prepared.suite.budgets = {{0, part.seconds}}, prepared.suite.show.reset();
    Overrides own = overrides;
    if (own.quick) own.quick = part.quick;
    locate(paper, folder, own_folder, prepared);
    of_suite(overrides.scenes, prepared.missing, scenes);
    for (const SceneEntry& scene : prepared.missing)
      if (std::ranges::find(overrides.scenes, scene.name) != overrides.scenes.end()) missing.insert(scene.file);
    own.scenes = of_suite(overrides.scenes, prepared.suite.scenes, scenes);
    own.methods = of_suite(overrides.methods, prepared.suite.methods, methods);
    if (own.scenes.empty() != overrides.scenes.empty() || own.methods.empty() != overrides.methods.empty()) continue;
    apply(own, prepared.suite);
    parts.push_back(std::move(prepared));
  }
  throw_if_unknown("scene", overrides.scenes, scenes);
  throw_if_unknown("method", overrides.methods, methods);
  if (parts.empty())
    throw Error(ErrorCode::kUsage,
                fmt::format("no part of the paper has a scene that is at hand, and a method, of those named{}",
                            missing.empty() ? ""
                                            : fmt::format("; --scenes FOLDER with {} is needed (`covary scenes` says "
                                                          "where they are from)",
                                                          fmt::join(missing, ", "))));
  return parts;
}

}  // namespace covary::lab
