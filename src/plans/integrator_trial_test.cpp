// SPDX-License-Identifier: Apache-2.0
// An integrator chosen by trials: the one with the least variance x rays, for any number of threads; films, replay and
// resumed renders use the chosen one.
#include "plans/integrator_trial.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "film/film_file.h"
#include "passes/training.h"
#include "plans/pass_files.h"
#include "support/files.h"
#include "support/plans.h"

namespace covary {
namespace {

const std::string kRoom = std::string(COVARY_SOURCE_DIR) + "/scenes/room.xml";

/// Radiance 1 plus or minus a uniform random number, at a given number of rays.
class Noisy : public Integrator {
 public:
  Noisy(std::string name, float noise, uint64_t rays) : name_(std::move(name)), noise_(noise), rays_(rays) {}
  std::shared_ptr<Integrator> clone() const override { return std::make_shared<Noisy>(name_, noise_, rays_); }
  void trace(const Scene&, std::span<CameraSample> samples, PathContext& context) const override {
    for (CameraSample& sample : samples) {
      sample.radiance = Spectrum(1 + noise_ * (sample.random.get_1d(1, Event::kLobe) - 0.5f));
      context.n_rays += rays_;
    }
  }
  std::string description() const override { return name_ + " noise"; }

 private:
  std::string name_;
  float noise_;
  uint64_t rays_;
};

class Choice : public Integrator {
 public:
  explicit Choice(std::vector<std::shared_ptr<Integrator>> choices) : choices_(std::move(choices)) {}
  std::shared_ptr<Integrator> clone() const override { return std::make_shared<Choice>(choices_); }
  void trace(const Scene&, std::span<CameraSample>, PathContext&) const override { FAIL() << "chosen before"; }
  std::span<const std::shared_ptr<Integrator>> choices() const override { return choices_; }
  std::string description() const override { return "choice"; }

 private:
  std::vector<std::shared_ptr<Integrator>> choices_;
};

std::string chosen_of(std::vector<std::shared_ptr<Integrator>> choices) {
  LoadedScene scene = load_sized(kRoom);
  scene.integrator = std::make_shared<Choice>(std::move(choices));
  return registered_name(*choose_integrator(scene, request_of(64), nullptr).integrator);
}

TEST(IntegratorTrial, TakesTheLeastVarianceForTheSameRays) {
  const auto simple = std::make_shared<Noisy>("simple", 0.5f, 10);
  const auto quiet = std::make_shared<Noisy>("quiet", 0.25f, 20);    // a quarter of the variance for twice the rays
  const auto costly = std::make_shared<Noisy>("costly", 0.1f, 400);  // 1 / 25 for 40 times the rays
  EXPECT_EQ(chosen_of({simple, costly, quiet}), "quiet");
  EXPECT_EQ(chosen_of({simple, costly}), "simple");
  EXPECT_EQ(chosen_of({costly, simple, quiet}), "quiet");
  const auto hardly = std::make_shared<Noisy>("hardly", 0.49f, 10);
  EXPECT_EQ(chosen_of({simple, hardly}), "simple") << "what is hardly better may be chance";
}

LoadedScene room_of_choice() {
  LoadOptions options;
  options.width = 40, options.height = 30;
  options.make_integrator = integrator_maker({"auto", {}});
  return load_scene(kRoom, options);
}

TEST(IntegratorTrial, IsTheSameForAnyNumberOfThreads) {
  const LoadedScene scene = room_of_choice();
  std::vector<IntegratorTrial> trials[2];
  for (const size_t threads : {1, 3}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    trials[threads == 3] = choose_integrator(scene, request_of(64), nullptr).trials;
  }
  ASSERT_EQ(trials[0].size(), 4u);
  for (size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(trials[0][i].variance, trials[1][i].variance) << trials[0][i].integrator;
    EXPECT_GT(trials[0][i].variance, 0) << trials[0][i].integrator;
    EXPECT_EQ(trials[0][i].rays, trials[1][i].rays);
  }
}

TEST(IntegratorTrial, LeavesOutWhatHasNoSamplesToLearn) {
  const LoadedScene scene = room_of_choice();
  const auto trials = choose_integrator(scene, request_of(8), nullptr).trials;
  EXPECT_EQ(trials[0].left_out, "");
  EXPECT_EQ(trials[1].left_out, "its training takes 16 of 8 samples");
  EXPECT_EQ(trials[1].variance, 0);
}

TEST(IntegratorTrial, RendersContinuesAndReplaysTheChosenOne) {
  const LoadedScene scene = room_of_choice();
  const test_support::TemporaryFolder folder;
  RenderRequest request = request_of(64);
  request.output = folder.file("a.exr");
  const Plan plan = plain_plan(Sampling::kIndependent);
  StopAfter stop(3);
  EXPECT_TRUE(render(scene, plan, request, stop.callbacks).interrupted);
  request.resume = true;
  const RenderResult result = render(scene, plan, request);
  const Film& film = result.passes[0].film;
  const uint32_t training = result.integrator->learning() ? result.integrator->learning()->training_spp() : 0;
  EXPECT_EQ(film.mean_count(), 64 - training) << "training is a part of the samples";
  EXPECT_TRUE(film.attributes.at(film_key::kSettings).starts_with(result.chosen + " "));
  EXPECT_TRUE(read_film_attributes(request.output).at(film_key::kTrial).starts_with(result.chosen + ": path 1, "));
  Spectrum sum(0);
  std::vector<SampleAddress> all(static_cast<size_t>(film.mean_count()), {Sampling::kIndependent, 0, 7, 9, 0, {}});
  for (size_t i = 0; i < all.size(); ++i) all[i].sample = i;
  for (const ReplayedSample& sample : replay(scene, plan, request, all)) sum += sample.value;
  EXPECT_NEAR(sum.g / static_cast<float>(all.size()), film.mean(7, 9).g, 1e-6f * film.mean(7, 9).g);
}

}  // namespace
}  // namespace covary
