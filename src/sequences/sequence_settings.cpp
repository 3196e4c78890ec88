// SPDX-License-Identifier: Apache-2.0
#include "sequences/sequence_settings.h"

#include "core/error.h"

namespace covary {
namespace {

std::string read_frames(const std::string& text, std::optional<FrameRange>& frames) {
  FrameRange range;
  if (!read_frame_range(text, range)) return "FIRST-LAST[:STEP] or one number, e.g. 1-48";
  frames = range;
  return "";
}

}  // namespace

void declare(Settings& s, SequenceSettings& v) {
  s.group("Sequences");
  s.text_as("frames", v.frames, "FIRST-LAST", read_frames,
            "Render these frames into numbered files: -o OUT_####.exr; frame n has the seed `seed` + 1,000,000 n",
            {.effect = OptionEffect::kSamples});
  s.text("camera-path", v.camera_path, "FILE", "Position of the camera in each frame (JSON)",
         {.names = OptionNames::kFile, .effect = OptionEffect::kSamples});
  s.real("fps", v.frames_per_second, {.low = 0.01, .high = 1000}, NumberWord{"auto", 0.0},
         "Frame n shows the time n / `fps` of the scene's animations and the camera path; auto: the path's, or 24 for "
         "glTF, 1 for others",
         {.effect = OptionEffect::kSamples});
  s.on_off("history", v.history,
           "Mix in the previous frame, moved to the current positions, where held-out samples prefer it");
  s.only_if(v.is_sequence(), {"camera-path", "fps", "history"},
            "without `frames` (one frame, too, e.g. 8, into OUT_####.exr)");
}

}  // namespace covary
