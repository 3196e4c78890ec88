// SPDX-License-Identifier: Apache-2.0
// Integrators that learn: identical bits for any number of threads, descriptions that distinguish trainings, and passes
// that reject mixtures of them. Uses a small integrator whose sums depend on the order of addition.
#include "passes/training.h"

#include <tbb/global_control.h>

#include <atomic>
#include <tuple>

#include "core/content_hash.h"
#include "plans/estimator_plans.h"
#include "plans/render.h"
#include "render_fixture.h"
#include "support/files.h"

namespace covary {
namespace {

using test_support::message_of;

const std::string kRoom = std::string(COVARY_SOURCE_DIR) + "/scenes/room.xml";
constexpr uint32_t kCells = 50;

/// Adds noise with mean zero to paths, proportional to the mean radiance learnt for the camera ray's direction.
class CellMeans final : public LearningIntegrator {
 public:
  CellMeans(std::shared_ptr<Integrator> inner, uint32_t spp) : inner_(std::move(inner)), spp_(spp) {}

  std::shared_ptr<Integrator> clone() const override { return std::make_shared<CellMeans>(inner_->clone(), spp_); }

  /// Planted bug: records are added in another order.
  bool backwards = false;
  std::vector<uint32_t> waves;  ///< trained_spp() before each update

  uint32_t pilot = 0;  ///< pilot_spp()
  bool pilot_once = false;

  uint32_t training_spp() const override { return spp_; }
  uint32_t pilot_spp() const override { return pilot; }
  bool pilot_goes_on() const override { return !pilot_once; }
  std::unique_ptr<ThreadState> make_thread_state() const override { return std::make_unique<State>(*inner_); }
  bool allows_negative() const override { return true; }

  void trace(const Scene& scene, std::span<CameraSample> samples, PathContext& context) const override {
    State& state = context.state_as<State>();
    inner_->trace(scene, samples, state.inner);
    for (CameraSample& sample : samples) {
      const uint32_t cell = static_cast<uint32_t>(kCells * 0.5f * (sample.ray.d.x + 1)) % kCells;
      if (!frozen()) state.seen.push_back({cell, sample.radiance});
      sample.radiance += means_[cell] * (8 * sample.random.get_1d(900, Event::kTechnique) - 4);
    }
  }

  std::unique_ptr<TrainingRecord> take_record(ThreadState& state) const override {
    auto record = std::make_unique<Record>();
    record->seen.swap(static_cast<State&>(state).seen);
    return record;
  }
  void absorb(const TrainingRecord& record) override {
    const auto& seen = static_cast<const Record&>(record).seen;
    all_.insert(all_.end(), seen.begin(), seen.end());
  }

 protected:
  void on_restart() override {
    all_ = {}, waves = {};
    means_.assign(kCells, Spectrum(0));
  }
  void update() override {
    waves.push_back(trained_spp());
    std::vector<Spectrum> sums(kCells);
    std::vector<float> counts(kCells);
    const auto add = [&](const Seen& s) { sums[s.cell] += s.value, ++counts[s.cell]; };
    if (backwards)
      std::for_each(all_.rbegin(), all_.rend(), add);
    else
      std::for_each(all_.begin(), all_.end(), add);
    for (uint32_t c = 0; c < kCells; ++c) means_[c] = sums[c] * (1 / std::max(counts[c], 1.0f));
  }
  void on_freeze() override { all_ = {}; }
  uint64_t state_hash() const override { return hash_bytes(std::as_bytes(std::span(means_))); }
  std::string settings_text() const override { return "cell-means " + inner_->description(); }

 private:
  struct Seen {
    uint32_t cell;
    Spectrum value;
  };
  struct State final : ThreadState {
    explicit State(const Integrator& integrator) : inner(integrator) {}
    PathContext inner;
    std::vector<Seen> seen;
  };
  struct Record final : TrainingRecord {
    std::vector<Seen> seen;
  };

  std::shared_ptr<Integrator> inner_;
  uint32_t spp_;
  std::vector<Seen> all_;
  std::vector<Spectrum> means_ = std::vector<Spectrum>(kCells);
};

TestScene load_room() {
  LoadOptions options;
  options.width = 70, options.height = 45;
  options.make_integrator = [](Parameters& parameters) -> std::shared_ptr<SceneObject> {
    return std::make_shared<CellMeans>(scene_integrator(parameters), 6);
  };
  return load_file(kRoom, options);
}

CellMeans& learner(const TestScene& scene) { return dynamic_cast<CellMeans&>(*scene.loaded.integrator); }

/// Trains the scene's integrator on the whole frame.
bool train_room(const TestScene& scene, uint64_t seed = 0, TrainingImage* image = nullptr) {
  return train(scene.scene(), learner(scene),
               {{0, 0, scene.loaded.width, scene.loaded.height}, scene.loaded.filter, nullptr, {}, {}, seed, image});
}

/// Settings of training samples that stay in the film.
PassSettings learning(const TestScene& scene, uint32_t spp) {
  PassSettings settings;
  settings.spp = spp, settings.seed = 7, settings.learner = &learner(scene);
  return settings;
}

TEST(Training, SameBitsForOneTwoAndFiveThreads) {
  std::vector<Film> films;
  std::vector<std::string> descriptions;
  for (const size_t threads : {1, 2, 5}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    const TestScene scene = load_room();
    EXPECT_TRUE(train_room(scene));
    films.push_back(render(scene, 4, 7));
    descriptions.push_back(scene.integrator().description());
  }
  for (const size_t i : {1, 2}) {
    EXPECT_TRUE(same_bits(films[0], films[i]));
    EXPECT_EQ(descriptions[0], descriptions[i]);
  }
  // Planted bug: the sums do depend on the order of the records.
  const TestScene scene = load_room();
  learner(scene).backwards = true;
  train_room(scene);
  EXPECT_NE(scene.integrator().description(), descriptions[0]);
}

TEST(Training, WavesDouble) {
  const TestScene scene = load_room();
  train_room(scene);
  EXPECT_EQ(learner(scene).waves, (std::vector<uint32_t>{0, 1, 2, 4}));
  EXPECT_EQ(learner(scene).trained_spp(), 6u);
}

TEST(Training, DescriptionTellsOneTrainingFromAnother) {
  std::vector<std::string> descriptions;
  for (const uint64_t seed : {0, 1, 0}) {
    const TestScene scene = load_room();
    EXPECT_TRUE(scene.integrator().description().ends_with(" untrained"));
    train_room(scene, seed);
    descriptions.push_back(scene.integrator().description());
    EXPECT_NE(descriptions.back().find("cell-means path min_depth=0"), std::string::npos);
    EXPECT_NE(descriptions.back().find(" training="), std::string::npos);
  }
  EXPECT_EQ(descriptions[0], descriptions[2]);
  EXPECT_NE(descriptions[0], descriptions[1]);
}

TEST(Training, SamplesMayStayInTheFilm) {
  const TestScene whole = load_room(), parts = load_room();
  Film film = new_film(whole), film_of_parts = new_film(parts);
  render_pass(whole.scene(), whole.integrator(), learning(whole, 16), film);
  for (const uint32_t spp : {1, 4, 16})
    render_pass(parts.scene(), parts.integrator(), learning(parts, spp), film_of_parts);
  EXPECT_EQ(learner(whole).trained_spp(), 16u);
  EXPECT_TRUE(same_bits(film, film_of_parts));
  learner(whole).freeze(), learner(parts).freeze();
  EXPECT_EQ(whole.integrator().description(), parts.integrator().description());
}

TEST(Training, NegativeSamplesStayWhereTheIntegratorAllowsThem) {
  const TestScene scene = load_room();
  train_room(scene);
  const Film film = render(scene, 1, 7);  // expects no bad samples
  EXPECT_LT(*std::min_element(film.data().begin(), film.data().end()), 0);
}

TEST(Training, PassesRefuseWhatWouldMixTrainings) {
  const TestScene scene = load_room();
  Film film = new_film(scene);
  PassSettings plain;
  plain.spp = 1;
  const auto error = [&](const PassSettings& settings) {
    return message_of([&] { render_pass(scene.scene(), scene.integrator(), settings, film); });
  };
  EXPECT_NE(error(plain).find("the integrator has not been trained"), std::string::npos);

  render_pass(scene.scene(), scene.integrator(), learning(scene, 2), film);
  film = new_film(scene);
  EXPECT_NE(error(learning(scene, 4)).find("the film has other samples than the integrator has learnt from"),
            std::string::npos);

  learner(scene).freeze();
  EXPECT_NE(error(learning(scene, 4)).find("the integrator cannot learn in this pass"), std::string::npos);
  EXPECT_EQ(error(plain), "no error");
  EXPECT_NE(message_of([&] { learner(scene).end_wave(3); }).find("a frozen integrator cannot learn"),
            std::string::npos);
}

TEST(Training, StoppedIsNotTrainedAndCanStartAgain) {
  const TestScene scene = load_room();
  const TestScene other = load_room();
  std::atomic<bool> stop{false};
  TrainingSettings settings{{0, 0, scene.loaded.width, scene.loaded.height}, scene.loaded.filter, &stop, {}};
  int tiles = 0;
  settings.progress = [&](uint64_t, uint64_t) {
    if (++tiles == 20) stop = true;  // a wave has 15
  };
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_FALSE(train(scene.scene(), learner(scene), settings));
  EXPECT_FALSE(learner(scene).frozen());
  EXPECT_EQ(learner(scene).trained_spp(), 1u);
  // Training again starts from scratch.
  EXPECT_TRUE(train_room(scene));
  EXPECT_TRUE(train_room(other));
  EXPECT_EQ(scene.integrator().description(), other.integrator().description());
}

TEST(Training, ImportanceIsMadeAfterThePilotAndEachLaterWaveButTheLast) {
  for (const auto& [pilot, once, expected] :
       {std::tuple(2u, false, std::vector<int>{2, 4}), std::tuple(1u, false, std::vector<int>{1, 2, 4}),
        std::tuple(1u, true, std::vector<int>{1}), std::tuple(0u, false, std::vector<int>{})}) {
    const TestScene scene = load_room();
    learner(scene).pilot = pilot, learner(scene).pilot_once = once;
    std::vector<int> seen;
    TrainingSettings settings{{0, 0, scene.loaded.width, scene.loaded.height}, scene.loaded.filter};
    settings.importance = [&](const Film& film) {
      seen.push_back(static_cast<int>(film.counts()[0]));
      return std::vector<Spectrum>(film.counts().size(), Spectrum(1));
    };
    EXPECT_TRUE(train(scene.scene(), learner(scene), settings));
    EXPECT_EQ(seen, expected) << pilot << once;
  }
}

TEST(Training, ARenderByAPlanTrainsFirst) {
  const TestScene scene = load_room(), other = load_room();
  RenderRequest request;
  request.spp = 2, request.seed = 7;
  const RenderResult result = render(scene.loaded, plain_plan(Sampling::kIndependent), request);
  EXPECT_TRUE(train_room(other, 7));
  const Film& film = result.passes[0].film;
  EXPECT_TRUE(same_bits(film, render(other, 2, 7)));
  const LearningIntegrator& trained = learner(other);
  EXPECT_EQ(trained.description(), trained.settings_text() + " training=" + film.attributes.at(film_key::kTraining));
  EXPECT_TRUE(film.attributes.at(film_key::kSettings).starts_with(trained.settings_text() + ";"));

  const ReplayedSample replayed =
      replay(scene.loaded, plain_plan(Sampling::kIndependent), request, {.x = 11, .y = 13, .sample = 1});
  PassSettings settings;
  settings.seed = 7, settings.filter = other.loaded.filter;
  EXPECT_EQ(replayed.value, replay_sample(other.scene(), other.integrator(), settings, 11, 13, 1).value);
}

TEST(Training, StoppedItLeavesNoFilm) {
  const TestScene scene = load_room();
  RenderRequest request;
  request.spp = 2;
  std::atomic<bool> stop{false};
  RenderCallbacks callbacks;
  callbacks.stop = &stop;
  callbacks.progress = [&](uint64_t, uint64_t) { stop = true; };
  const RenderResult result = render(scene.loaded, plain_plan(Sampling::kIndependent), request, callbacks);
  EXPECT_TRUE(result.interrupted);
  EXPECT_FALSE(result.complete);
  EXPECT_TRUE(result.passes.empty());
}

}  // namespace
}  // namespace covary
