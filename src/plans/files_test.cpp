// SPDX-License-Identifier: Apache-2.0
// What renders find, keep and leave on disk, and how much memory they may use.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <map>
#include <tuple>

#include "film/film_file.h"
#include "film/image_file.h"
#include "imageio/output_file.h"
#include "integrators/aov.h"
#include "plans/estimator_plans.h"
#include "plans/folder_lock.h"
#include "plans/memory.h"
#include "plans/render.h"
#include "support/files.h"
#include "support/plans.h"

namespace covary {
namespace {

namespace fs = std::filesystem;
using test_support::contains;
using test_support::message_of;
using test_support::TemporaryFolder;

const std::string kRoom = std::string(COVARY_SOURCE_DIR) + "/scenes/room.xml";

TEST(Passes, FilmsThatAreThereAreNeitherUsedNorReplacedUnasked) {
  const LoadedScene scene = load_sized(kRoom);
  const TemporaryFolder folder;
  RenderRequest request = request_of(24);
  request.passes = folder.file("films");
  render(scene, average_plan(), request);
  const Film film = read_film(request.passes + "/crn.exr");
  for (uint32_t spp : {12, 24, 48}) {
    request.spp = spp;
    const std::string message = message_of([&] { render(scene, average_plan(), request); }, ErrorCode::kInput);
    EXPECT_TRUE(contains(message, "films/crn.exr' already exists; `resume` continues it"));
    EXPECT_TRUE(contains(message, "`overwrite` replaces it"));
  }
  request.resume = true;
  request.seed = 6;
  EXPECT_TRUE(contains(message_of([&] { render(scene, average_plan(), request); }, ErrorCode::kInput),
                       "was rendered with seed 5, this command asks for 6; `overwrite` replaces it"));
  EXPECT_EQ(read_film(request.passes + "/crn.exr").data(), film.data());
  request.resume = false;
  request.overwrite = true;
  render(scene, average_plan(), request);
  EXPECT_EQ(read_film_attributes(request.passes + "/crn.exr").at("seed"), "6");
}

TEST(Passes, CostsThatMakeNoSenseAreLeftOutWithAWarning) {
  const LoadedScene scene = load_sized(kRoom);
  const TemporaryFolder folder;
  RenderRequest request = request_of(24);
  request.passes = folder.file("films");
  const double seconds = render(scene, average_plan(), request).passes[0].result.seconds;
  request.resume = true;
  EXPECT_EQ(render(scene, average_plan(), request).passes[0].result.seconds, seconds);
  for (const char* text :
       {R"({"samples": "many", "rays": 1, "seconds": 1})", R"({"samples": 1, "rays": 1, "seconds": -1})",
        R"({"samples": 1, "rays": -1, "seconds": 1})", R"({"samples": 1.5, "rays": 1, "seconds": 1})",
        R"({"samples": 1, "rays": 1, "seconds": 1e999})", R"({"samples": 1, "rays": 1, "seconds": null})",
        R"({"samples": 1, "rays": 1, "seconds": 1, "estimate_seconds": 2})", R"({"samples": 1, "rays": 1})", "[1, 2]",
        "7", "", "{"}) {
    std::ofstream(request.passes + "/crn.json") << text;
    std::vector<std::string> warnings;
    RenderCallbacks callbacks;
    callbacks.warning = [&](const std::string& warning) { warnings.push_back(warning); };
    const RenderResult result = render(scene, average_plan(), request, callbacks);
    ASSERT_EQ(warnings.size(), 1u) << text;
    EXPECT_TRUE(contains(warnings[0], "films/crn.json' is not used, so that times count this run alone: ")) << text;
    EXPECT_EQ(result.passes[0].result.seconds, 0) << text;
    EXPECT_EQ(result.passes[0].result.n_samples, 0u) << text;
  }
}

TEST(Passes, AFileInPlaceOfTheFolderIsNamed) {
  const LoadedScene scene = load_sized(kRoom);
  const TemporaryFolder folder;
  RenderRequest request = request_of(24);
  request.passes = folder.file("films");
  std::ofstream(request.passes) << "text";
  EXPECT_TRUE(contains(message_of([&] { render(scene, average_plan(), request); }, ErrorCode::kIo),
                       "films' is not a folder; films of passes are kept in one"));
}

/// A plan of two passes whose estimator fails.
Plan failing_plan() {
  return with_image(average_plan(), [](const auto&, const auto&) -> EstimatorResult {
    throw Error(ErrorCode::kInput, "no image today");
  });
}

/// `path`, but it fails if radiance is separated by number of edges.
class FailingLengths : public Integrator {
 public:
  explicit FailingLengths(const Integrator& path) : path_(path.clone()) {}
  std::shared_ptr<Integrator> clone() const override { return std::make_shared<FailingLengths>(*path_); }
  void prepare(const Scene& scene) override { path_->prepare(scene); }
  std::unique_ptr<ThreadState> make_thread_state() const override { return path_->make_thread_state(); }
  void trace(const Scene& scene, std::span<CameraSample> samples, PathContext& context) const override {
    if (context.by_part.n_parts > 0) throw Error(ErrorCode::kInput, "no lengths today");
    path_->trace(scene, samples, context);
  }
  std::string description() const override { return path_->description(); }
  std::optional<int> longest_path() const override { return 3; }

 private:
  std::shared_ptr<Integrator> path_;
};

/// The warnings of a render that must fail with this message.
std::vector<std::string> warnings_of_failure(const std::string& message, const LoadedScene& scene, const Plan& plan,
                                             const RenderRequest& request) {
  std::vector<std::string> warnings;
  RenderCallbacks callbacks;
  callbacks.warning = [&](const std::string& warning) { warnings.push_back(warning); };
  EXPECT_TRUE(contains(message_of([&] { render(scene, plan, request, callbacks); }), message));
  return warnings;
}

TEST(Failure, FilmsOfAFailedEstimateAreKeptAndContinued) {
  const LoadedScene scene = load_sized(kRoom);
  const TemporaryFolder folder;
  RenderRequest request = request_of(24);
  request.output = folder.file("whole.exr");
  render(scene, average_plan(), request);
  request.output = folder.file("a.exr");
  const std::vector<std::string> warnings = warnings_of_failure("no image today", scene, failing_plan(), request);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_TRUE(contains(warnings[0], "the films are kept in '" + folder.file("a.passes") + "'; `resume` continues"));
  for (const char* name : {"a.passes/crn.exr", "a.passes/independent.exr"})
    EXPECT_EQ(read_film(folder.file(name)).mean_count(), 12) << name;
  request.resume = true;
  uint64_t taken = 0;
  RenderCallbacks callbacks;
  callbacks.progress = [&](uint64_t done, uint64_t) { taken = std::max(taken, done); };
  render(scene, average_plan(), request, callbacks);
  EXPECT_EQ(taken, 0u) << "no sample was lost";
  EXPECT_EQ(read_image(request.output).image.data, read_image(folder.file("whole.exr")).image.data);
  EXPECT_FALSE(fs::exists(folder.file("a.passes")));
}

TEST(Failure, FilmsOfAFolderAreThereBeforeTheEstimate) {
  const LoadedScene scene = load_sized(kRoom);
  const TemporaryFolder folder;
  RenderRequest request = request_of(24);
  request.output = folder.file("a.exr"), request.passes = folder.file("films");
  const Plan plan = with_image(average_plan(), [&](const auto& make, const auto&) {
    for (const char* name : {"films/crn.exr", "films/independent.exr"}) {
      EXPECT_EQ(read_film(folder.file(name)).mean_count(), 12) << name;
      EXPECT_EQ(attribute_of(folder.file(name), "complete"), "true") << name;
    }
    return make();
  });
  render(scene, plan, request);
}

TEST(Estimate, GetsAllAuxiliaryImagesAsFeatures) {
  const LoadedScene scene = load_sized(kRoom);
  const TemporaryFolder folder;
  RenderRequest request = request_of(24);
  request.output = folder.file("a.exr");
  Method guided_average = average_estimator();
  guided_average.reads_features = true;
  std::map<std::string, std::vector<float>> guided;
  const Plan plan = with_image(pair_plan(guided_average), [&](const auto& make, const MethodSettings& settings) {
    guided = {{"Albedo", settings.features.albedo->data},
              {"N", settings.features.normal->data},
              {"DenoisingAlbedo", settings.features.denoising_albedo->data},
              {"DenoisingNormal", settings.features.denoising_normal->data},
              {"P", settings.features.position->data}};
    return make();
  });
  const RenderResult result = render(scene, plan, request);
  for (const auto& [name, data] : guided) EXPECT_EQ(data, result.aovs.at(name).data) << name;
  EXPECT_EQ(guided.size(), kAuxiliaryFeatures.size());
}

TEST(Failure, FilmsOfFailedPathLengthsAreKept) {
  LoadedScene scene = load_sized(kRoom);
  scene.integrator = std::make_shared<FailingLengths>(integrator_of(scene));
  const TemporaryFolder folder;
  RenderRequest request = request_of(24);
  request.output = folder.file("a.exr");
  request.path_lengths = true;
  std::vector<std::string> warnings = warnings_of_failure("no lengths today", scene, average_plan(), request);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_TRUE(contains(warnings[0], "the films are kept in '" + folder.file("a.passes") + "'; `resume` continues"));
  EXPECT_EQ(read_film(folder.file("a.passes/crn.exr")).mean_count(), 12);

  request.output = folder.file("plain.exr");
  warnings = warnings_of_failure("no lengths today", scene, plain_plan(Sampling::kIndependent), request);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_TRUE(contains(warnings[0], "the film is kept in '" + request.output + "'; `resume` continues"));
  EXPECT_EQ(read_film(request.output).mean_count(), 24);
  EXPECT_EQ(attribute_of(request.output, "complete"), "false");
}

TEST(Failure, FilmsOfAnImageThatCannotBeWrittenAreKept) {
  const LoadedScene scene = load_sized(kRoom);
  const TemporaryFolder folder;
  fs::create_directory(folder.file("images"));
  RenderRequest request = request_of(24);
  request.output = folder.file("images/a.exr"), request.passes = folder.file("films");
  const Plan plan = with_image(average_plan(), [&](const auto& make, const auto&) {
    fs::remove(folder.file("images"));
    return make();
  });
  warnings_of_failure("no such folder", scene, plan, request);
  EXPECT_EQ(read_film(folder.file("films/crn.exr")).mean_count(), 12);
  EXPECT_FALSE(fs::exists(folder.file("films/.lock")));
}

TEST(Failure, OutputsThatCannotBeWrittenAreToldBeforeAnyWork) {
  const LoadedScene scene = load_sized(kRoom);
  const TemporaryFolder folder;
  write_text_file(folder.file("file"), "text");
  const std::vector<std::tuple<std::string, ErrorCode, std::string>> cases{
      {"missing/at/a.exr", ErrorCode::kIo, "no such folder " + folder.file("missing/at")},
      {"file/a.exr", ErrorCode::kIo, "no such folder " + folder.file("file")},
      {"a.png", ErrorCode::kUsage,
       "`output` '" + folder.file("a.png") + "': the name must end in .exr; 'covary convert"},
      {"a", ErrorCode::kUsage, "the name must end in .exr"}};
  for (const auto& [name, code, message] : cases) {
    RenderRequest request = request_of(24);
    request.output = folder.file(name);
    request.checkpoint_seconds = 300;
    RenderCallbacks callbacks;
    callbacks.stage = [](RenderStage) { ADD_FAILURE() << "begins"; };
    EXPECT_TRUE(contains(message_of([&] { render(scene, average_plan(), request, callbacks); }, code), message));
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()), 1);
}

TEST(FolderLock, NamesTheProcessThatHoldsTheFolder) {
  const TemporaryFolder folder;
  std::array<int, 2> ready{}, done{};
  ASSERT_EQ(pipe(ready.data()) + pipe(done.data()), 0);
  const pid_t child = fork();
  if (child == 0) {
    const FolderLock lock(folder.file("films"));
    char byte = 'x';
    if (write(ready[1], &byte, 1) != 1 || read(done[0], &byte, 1) != 1) _exit(1);
    _exit(0);  // as if killed: the file remains
  }
  char byte = 'x';
  ASSERT_EQ(read(ready[0], &byte, 1), 1);
  EXPECT_TRUE(contains(message_of([&] { FolderLock(folder.file("films")); }, ErrorCode::kIo),
                       "process " + std::to_string(child) + " renders into the folder"));
  ASSERT_EQ(write(done[1], &byte, 1), 1);
  int status = 1;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
  EXPECT_TRUE(fs::exists(folder.file("films/.lock")));
  { const FolderLock lock(folder.file("films")); }
  EXPECT_TRUE(fs::is_empty(folder.file("films"))) << "removed at the end";
  for (const int file : {ready[0], ready[1], done[0], done[1]}) close(file);
}

TEST(FolderLock, MakesTheLastFolderOnlyAsOutputsDo) {
  const TemporaryFolder folder;
  EXPECT_TRUE(contains(message_of([&] { FolderLock(folder.file("missing/films")); }, ErrorCode::kIo),
                       "there is no folder '" + folder.file("missing") + "', which would hold it"));
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

TEST(Memory, CountsFilmsAuxiliaryImagesAndEstimator) {
  const LoadedScene scene = load_sized(kRoom, 100, 50);
  RenderRequest request = request_of(48);
  Method average = average_estimator();
  const auto memory_now = [&] { return render_memory(scene, pair_plan(average), request); };
  average.memory.always = 100;
  const RenderMemory memory = memory_now();
  EXPECT_EQ(memory.films, 2 * 5000 * (12 * 12 + 4));
  EXPECT_EQ(memory.estimate, 5000 * (100 + 12));
  average.memory.of_halves = 20, average.memory.of_halves_per_group = 7;
  average.memory.groups_for_halves = 12;
  EXPECT_EQ(memory_now().estimate, 5000 * (100 + 20 + 12 * 7 + 12));
  average.memory.groups_for_halves = 13;
  EXPECT_EQ(memory_now().estimate, 5000 * (100 + 12));
  request.aovs = true;
  EXPECT_EQ(memory_now().films - memory.films, 5000 * 60);
  request.crop = CropWindow{0, 0, 10, 10};
  EXPECT_EQ(render_memory(scene, plain_plan(Sampling::kIndependent), request).films, 100 * (12 + 4 + 60));
}

TEST(Memory, MoreThanTheLimitIsRefusedBeforeItIsTaken) {
  const LoadedScene scene = load_sized(kRoom);
  Method average = average_estimator();
  average.memory.always = memory_limit();
  EXPECT_TRUE(contains(message_of([&] { render(scene, pair_plan(average), request_of(24)); }, ErrorCode::kUsage),
                       "40 x 30 pixels need "));
}

}  // namespace
}  // namespace covary
