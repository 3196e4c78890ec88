// SPDX-License-Identifier: Apache-2.0
// Placeholder for the integrator that a trial before the render finds best.
#include "core/error.h"
#include "integrators/registry.h"

namespace covary {
namespace {

class AutoIntegrator : public Integrator {
 public:
  explicit AutoIntegrator(const PathLengthSettings& lengths) : lengths_(lengths) {
    for (const char* name : {"path", "controlled-path", "guided-path", "bdpt"}) {
      Settings standard;
      choices_.push_back(find_integrator(name)->make(standard, lengths));
    }
  }
  std::shared_ptr<Integrator> clone() const override { return std::make_shared<AutoIntegrator>(lengths_); }
  void trace(const Scene&, std::span<CameraSample>, PathContext&) const override {
    throw Error(ErrorCode::kInternal, "an integrator is chosen before anything is traced");
  }
  std::span<const std::shared_ptr<Integrator>> choices() const override { return choices_; }
  bool sees_media() const override { return true; }
  std::string description() const override { return "auto" + lengths_.text(); }

 private:
  PathLengthSettings lengths_;
  std::vector<std::shared_ptr<Integrator>> choices_;
};

}  // namespace

std::shared_ptr<Integrator> make_auto(Settings&, const PathLengthSettings& lengths) {
  return std::make_shared<AutoIntegrator>(lengths);
}

}  // namespace covary
