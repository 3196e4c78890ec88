// SPDX-License-Identifier: Apache-2.0
// Makes one image with its error of renders in files, by the method that covary uses unless told otherwise.
//
//     combine_files OUT.exr INDEPENDENT.exr... [--crn CRN.exr...]
//
// INDEPENDENT: two or more renders by any program that differ in their seed alone, or one film of covary; they are
// denoised. CRN: likewise, but with the same random numbers in all pixels; IICV then joins the two images first.
#include <covary/combine/combine.h>
#include <covary/combine/grouped_file.h>
#include <covary/combine/registry.h>
#include <covary/combine/result_file.h>
#include <covary/denoising/denoising_choice.h>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <optional>
#include <string>
#include <vector>

int main(int argc, char** argv) try {
  const std::vector<std::string> words(argv + 1, argv + argc);
  const auto option = std::find(words.begin(), words.end(), "--crn");
  if (words.size() < 2 || option - words.begin() < 2 || option + 1 == words.end())
    return std::fprintf(stderr, "combine_files OUT.exr INDEPENDENT.exr... [--crn CRN.exr...]\n"), 2;
  const covary::GroupedFile independent({words.begin() + 1, option});
  std::optional<covary::GroupedFile> crn;
  if (option != words.end()) crn.emplace(std::vector<std::string>(option + 1, words.end()));

  covary::CombineRequest request;  // refers to the files, whose rows it reads when they are needed
  request.independent = covary::source_of(independent);
  if (crn) request.crn = covary::source_of(*crn);
  request.estimator = covary::make_default_estimator(crn.has_value(), {}, {covary::DenoisingChoice::kAuto});
  request.settings.std_error = true;
  covary::limit_memory(request, {});                          // as the program does
  request.checked = [](const covary::InputFindings& found) {  // errors among the findings end combine()
    for (const covary::Finding& finding : found.findings) std::fprintf(stderr, "%s\n", finding.text.c_str());
  };
  covary::CombinedImage combined = covary::combine(request);

  for (const std::string& lost :
       covary::write_result(words[0], request.independent.origin.place, {{"covary:estimator", request.estimator.text}},
                            combined.image, combined.layers, independent.source()))
    std::fprintf(stderr, "%s\n", lost.c_str());
  std::printf("%d + %d groups", crn ? crn->groups() : 0, independent.groups());
  if (combined.predicted)
    std::printf(", predicted relMSE %.3g%s", combined.predicted->relmse,
                combined.predicted->doubt.empty() ? "" : " (unsure)");
  std::printf("\n");
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "combine_files: %s\n", error.what());
  return 1;
}
