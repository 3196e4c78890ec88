// SPDX-License-Identifier: Apache-2.0
#include "estimators/grouped_image.h"

#include <fmt/format.h>

#include "core/error.h"

namespace covary {

void throw_if_any(const std::string& name, const std::vector<std::string>& problems) {
  if (problems.empty()) return;
  std::string text = name + ": ";
  for (size_t i = 0; i < problems.size(); ++i) text += (i ? "; " : "") + problems[i];
  throw Error(ErrorCode::kUsage, text);
}

void check_inputs(const GroupedImage& crn, const GroupedImage& independent, int min_crn_groups,
                  int min_independent_groups, std::vector<std::string>& problems) {
  if (crn.width < 1 || crn.height < 1 || !crn.data) problems.push_back("the CRN image is empty");
  if (independent.width < 1 || independent.height < 1 || !independent.data)
    problems.push_back("the independent image is empty");
  if (crn.width != independent.width || crn.height != independent.height)
    problems.push_back(
        fmt::format("the CRN image is {} x {} and the independent image {} x {}; they must have the same size",
                    crn.width, crn.height, independent.width, independent.height));
  if (crn.groups < min_crn_groups)
    problems.push_back(fmt::format("the CRN image has {} group{}, at least {} are needed (12 are recommended)",
                                   crn.groups, crn.groups == 1 ? "" : "s", min_crn_groups));
  if (independent.groups < min_independent_groups)
    problems.push_back(fmt::format("the independent image has {} group{}, at least {} are needed with these settings",
                                   independent.groups, independent.groups == 1 ? "" : "s", min_independent_groups));
}

}  // namespace covary
