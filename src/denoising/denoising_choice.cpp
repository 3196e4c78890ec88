// SPDX-License-Identifier: Apache-2.0
#include "denoising/denoising_choice.h"

#include <fmt/format.h>

#include <cstdlib>
#include <string>

#include "denoising/denoise.h"
#include "denoising/mixed_denoising.h"

namespace covary {

void declare(Settings& s, DenoisingChoice& v, bool is_all) {
  s.group("Denoising");
  s.one_of("denoise", v.mode, denoise_mode_names(),
           "Mix in denoised images where held-out samples prefer them: for the least error (auto), or with less bias",
           {.level = OptionLevel::kBasic});
  s.text("oidn", v.oidn, "off|LIBRARY",
         std::string(is_all ? "For `denoise`" : "For `denoise` and `cv-variance` relative-oidn") +
             ": Open Image Denoise's library or its folder; default: searched for; 'off': not used",
         {.names = OptionNames::kLibrary});
  s.only_if(v.denoises() || !is_all, {"oidn"}, kNotDenoised);
}

std::string missing_network(const DenoisingChoice& choice) {
  if (!choice.uses_oidn() || !choice.oidn.empty() || !find_denoiser().empty()) return "";
  if (const char* named = std::getenv("COVARY_OIDN"); named && *named)
    return fmt::format(
        "the environment variable COVARY_OIDN is '{}', where Open Image Denoise is not found, so only "
        "filters denoise the image (`oidn` off silences this note)",
        named);
  return "Open Image Denoise is not installed, so only filters denoise the image; `pip install pyoidn` installs it "
         "(`oidn` off silences this note)";
}

}  // namespace covary
