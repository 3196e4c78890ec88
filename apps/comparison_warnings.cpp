// SPDX-License-Identifier: Apache-2.0
#include "comparison_warnings.h"

#include <fmt/format.h>

#include "metrics/provenance.h"

namespace covary {
namespace {

void append(const std::vector<std::string>& more, std::vector<std::string>& all) {
  all.insert(all.end(), more.begin(), more.end());
}

}  // namespace

std::vector<std::vector<std::string>> warn_of_comparison(const std::vector<std::string>& images,
                                                         const std::vector<std::string>& references,
                                                         std::set<std::string>& printed, bool may_have_two) {
  std::vector<ImageFacts> facts;
  std::vector<std::string> of_references;
  for (const std::string& path : references) {
    facts.push_back(read_facts(path));
    append(image_warnings(facts.back()), of_references);
  }
  if (facts.size() == 2) append(comparison_warnings(facts[0], facts[1]), of_references);
  std::vector<std::vector<std::string>> result;
  for (const std::string& path : images) {
    const ImageFacts image = read_facts(path);
    std::vector<std::string>& found = result.emplace_back(of_references);
    append(image_warnings(image), found);
    for (const ImageFacts& reference : facts) append(comparison_warnings(image, reference), found);
    if (facts.size() == 1) append(reference_warnings(image, facts[0], may_have_two), found);
  }
  for (const auto& warnings : result)
    for (const std::string& warning : warnings)
      if (printed.insert(warning).second) fmt::print(stderr, "warning: {}\n", warning);
  return result;
}

}  // namespace covary
