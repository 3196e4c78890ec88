// SPDX-License-Identifier: Apache-2.0
// Suite files: JSON to Suite.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <limits>

#include "core/error.h"
#include "lab/located_json.h"
#include "lab/suite.h"

namespace covary::lab {
namespace {

using Json = nlohmann::ordered_json;

constexpr int64_t kLargestInt = std::numeric_limits<int>::max();
constexpr int64_t kLargestSpp = 1 << 30;  // as for `covary render --spp`
constexpr size_t kMaxSeeds = 100000;      // as for `covary experiment --seeds`

class SuiteReader {
 public:
  SuiteReader(const LocatedJson& document, const CommandCheck& check) : document_(document), check_(check) {}

  Suite read() {
    if (!document_.value.is_object())
      throw Error(ErrorCode::kInput, document_.name + ":1: expected an object, the suite");
    ObjectReader top = at("");
    Suite suite;
    suite.name = top.required_text("name");
    suite.title = top.text("title").value_or(suite.name);
    suite.description = top.text("description").value_or("");
    suite.scene_root = top.text("scene_root").value_or("");
    for (const std::string& pointer : top.objects("scenes")) suite.scenes.push_back(scene(pointer));
    for (const std::string& pointer : top.objects("methods")) suite.methods.push_back(method(pointer));
    for (const std::string& pointer : top.objects("budgets")) suite.budgets.push_back(budget(pointer));
    suite.seeds = seeds(top);
    suite.common_options = top.texts("common_options");
    suite.baseline = top.text("baseline").value_or(suite.methods.empty() ? "" : suite.methods[0].name);
    if (const auto pointer = top.object("show")) suite.show = budget(*pointer);
    if (const auto pointer = top.object("reference")) suite.reference = reference(*pointer);
    if (const auto pointer = top.object("published")) published(*pointer, suite);
    top.finish();
    if (check_) check_commands(suite);
    if (problems_.empty()) return suite;
    throw Error(ErrorCode::kInput, fmt::format("{}", fmt::join(problems_, "\n")));
  }

 private:
  ObjectReader at(const std::string& pointer) { return {document_, pointer, problems_}; }

  SceneEntry scene(const std::string& pointer) {
    ObjectReader reader = at(pointer);
    SceneEntry scene;
    scene.name = reader.required_text("name");
    scene.file = reader.required_text("file");
    scene.resolution = reader.text("resolution").value_or("");
    scene.crop = reader.text("crop").value_or("");
    scene.max_depth = reader.whole("max_depth", -1, kLargestInt);
    scene.defines = reader.texts("defines");
    scene.credit = reader.text("credit").value_or("");
    scene.frames = reader.text("frames").value_or("");
    scene.camera_path = reader.text("camera_path").value_or("");
    scene.layer = reader.text("layer").value_or("");
    for (const std::string& inset : reader.objects("insets")) scene.insets.push_back(window(inset));
    if (const auto own = reader.object("reference")) scene.reference = reference(*own);
    reader.finish();
    return scene;
  }

  CropWindow window(const std::string& pointer) {
    ObjectReader reader = at(pointer);
    const auto number = [&](const char* name, int64_t lowest) {
      const std::optional<int64_t> value = reader.whole(name, lowest, kLargestInt);
      if (!value) reader.problem("", fmt::format("lacks '{}', in pixels", name));
      return static_cast<int>(value.value_or(lowest));
    };
    CropWindow result{number("x", 0), number("y", 0), number("w", 1), number("h", 1)};
    reader.finish();
    return result;
  }

  MethodEntry method(const std::string& pointer) {
    ObjectReader reader = at(pointer);
    MethodEntry method;
    method.name = reader.required_text("name");
    method.options = reader.texts("options");
    method.program = reader.text("program").value_or("");
    for (const auto& [name, flag] :
         {std::pair{"unbiased", &method.unbiased}, {"optional", &method.optional}, {"renders", &method.renders}})
      if (const Json* value = reader.find(name)) {
        if (value->is_boolean())
          *flag = value->get<bool>();
        else
          reader.problem(name, "expected true or false, found " + shown(*value));
      }
    if (const Json* steps = reader.find("then")) {
      const auto is_step = [](const Json& step) {
        if (!step.is_array() || step.empty()) return false;
        for (const Json& word : step)
          if (!word.is_string()) return false;
        return true;
      };
      bool good = steps->is_array();
      for (const Json& step : *steps) good = good && is_step(step);
      if (good)
        method.then = steps->get<std::vector<std::vector<std::string>>>();
      else
        reader.problem("then", "expected a list of commands, each a list of words, e.g. [[\"denoise\"]]");
    }
    reader.finish();
    return method;
  }

  Budget budget(const std::string& pointer) {
    ObjectReader reader = at(pointer);
    const std::optional<int64_t> spp = reader.whole("spp", 1, kLargestSpp);
    const std::optional<double> seconds = reader.positive("seconds");
    if (spp.has_value() == seconds.has_value()) reader.problem("", "expected either 'spp' or 'seconds'");
    reader.finish();
    return {static_cast<uint32_t>(spp.value_or(0)), seconds.value_or(0)};
  }

  ReferencePlan reference(const std::string& pointer) {
    ObjectReader reader = at(pointer);
    ReferencePlan plan;
    const std::optional<int64_t> spp = reader.whole("spp", 1, kLargestSpp);
    plan.spp = static_cast<uint32_t>(spp.value_or(0));
    plan.files = reader.texts("files");
    if (spp.has_value() == !plan.files.empty())
      reader.problem("", "expected either 'spp', samples per pixel of each half, or 'files'");
    if (plan.files.size() > 2) reader.problem("files", "expected one or two files");
    reader.finish();
    return plan;
  }

  std::vector<uint64_t> seeds(ObjectReader& top) {
    std::vector<uint64_t> result;
    const Json* value = top.find("seeds");
    if (!value) return {1};
    if (value->is_number_unsigned()) {
      const uint64_t n = value->get<uint64_t>();
      if (n < 1 || n > kMaxSeeds)
        top.problem("seeds", fmt::format("expected 1 to {} seeds, found {}", kMaxSeeds, n));
      else
        for (uint64_t s = 1; s <= n; ++s) result.push_back(s);
    } else if (value->is_array() && value->size() <= kMaxSeeds &&
               std::all_of(value->begin(), value->end(), [](const Json& s) { return s.is_number_unsigned(); })) {
      result = value->get<std::vector<uint64_t>>();
    } else {
      top.problem("seeds", fmt::format("expected a number of seeds or a list of at most {} seeds, found {}", kMaxSeeds,
                                       shown(*value)));
    }
    return result;
  }

  void published(const std::string& pointer, Suite& suite) {
    ObjectReader reader = at(pointer);
    suite.published_source = reader.required_text("source");
    table(reader, "relmse", suite.published_relmse);
    table(reader, "ratio", suite.published_ratio);
    reader.finish();
  }

  template <typename Table>
  void table(ObjectReader& reader, const std::string& name, Table& target) {
    if (!reader.object(name)) return;
    try {
      target = reader.find(name)->get<Table>();
    } catch (const Json::exception&) {
      reader.problem(name, "expected {scene: {method: {budget: number}}}");
    }
  }

  void check_commands(const Suite& suite) {
    const size_t n_common = suite.common_options.size();
    for (size_t m = 0; m < suite.methods.size(); ++m) {
      const MethodEntry& method = suite.methods[m];
      std::vector<std::string> render = {"render"};
      render.insert(render.end(), suite.common_options.begin(), suite.common_options.end());
      render.insert(render.end(), method.options.begin(), method.options.end());
      for (const WordProblem& p : check_(render)) {
        if (p.word > 0 && p.word <= n_common)
          add_once(fmt::format("common_options/{}", p.word - 1), p.text);
        else
          add_once(p.word == 0 ? fmt::format("methods/{}", m)
                               : fmt::format("methods/{}/options/{}", m, p.word - 1 - n_common),
                   of_method(method, p.text));
      }
      for (size_t i = 0; i < method.then.size(); ++i)
        for (const WordProblem& p : check_(method.then[i]))
          add_once(fmt::format("methods/{}/then/{}/{}", m, i, p.word), of_method(method, p.text));
    }
  }

  static std::string of_method(const MethodEntry& method, const std::string& text) {
    return fmt::format("method '{}': {}", method.name, text);
  }

  /// Problems of the common options would otherwise be reported with each method.
  void add_once(const std::string& place, const std::string& text) {
    at("").problem(place, text);
    if (std::find(problems_.begin(), problems_.end() - 1, problems_.back()) != problems_.end() - 1)
      problems_.pop_back();
  }

  const LocatedJson& document_;
  const CommandCheck& check_;
  std::vector<std::string> problems_;
};

}  // namespace

Suite parse_suite(const std::string& text, const std::string& name, const CommandCheck& check) {
  const LocatedJson document = parse_located(text, name);
  return SuiteReader(document, check).read();
}

}  // namespace covary::lab
