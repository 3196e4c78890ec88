// SPDX-License-Identifier: Apache-2.0
// covary merge: the film of all samples of several films.
#include <memory>
#include <vector>

#include "commands.h"
#include "film/film_file.h"
#include "film/merge.h"
#include "film/outputs.h"

namespace covary {
namespace {

struct MergeOptions {
  std::vector<std::string> inputs;
  std::string output;
};

void merge(const MergeOptions& options) {
  Outputs outputs;
  outputs.reads(options.inputs);
  outputs.writes("-o", options.output, OutputKind::kFilm);
  Film merged = merge_film_files(options.inputs);
  merged.attributes[film_key::kVersion] = COVARY_VERSION;
  merged.attributes[film_key::kCommand] = command_line();
  write_film(options.output, merged);
}

}  // namespace

void add_merge(CLI::App& app) {
  const auto options = std::make_shared<MergeOptions>();
  CLI::App* command = app.add_subcommand("merge", "Merge films of one scene with different seeds into one film");
  command->add_option("FILMS", options->inputs, "Films (EXR) written by covary render")
      ->required()
      ->expected(2, 100000);
  command->add_option("-o,--output", options->output, "The merged film (EXR)")->required();
  command->callback([options] { merge(*options); });
}

}  // namespace covary
