// SPDX-License-Identifier: Apache-2.0
// Grouped images in EXR files of any renderer: films of covary, one file with a layer per group, or one file per group
// as Mitsuba 3, pbrt-v4 and Blender write them. Rows are read on demand, so that memory does not depend on the image
// height.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "film/exr.h"
#include "film/grouped_image.h"

namespace covary {

class GroupedFile {
 public:
  /// One path: all groups, as layers that differ in a number (group00.R, group00.G, …), or a single image. Several
  /// paths: one image each, the groups in the order given. An image is a colour layer of film/image_file.h; where a
  /// file holds several, the picture among them is taken if there is one, and `layer` names it otherwise (or the
  /// layers of the groups without their number). Throws Error(kIo), and Error(kInput) with the layers there are.
  explicit GroupedFile(const std::vector<std::string>& paths, const std::string& layer = "");

  int width() const { return place_.window.width; }
  int height() const { return place_.window.height; }
  const ImagePlace& place() const { return place_; }
  int groups() const { return static_cast<int>(groups_.size()); }
  /// Samples per pixel of all groups together, their mean where pixels differ; 0 where the files do not tell.
  double samples() const { return samples_; }
  /// Whether it is known how many samples each pixel has, so that read_rows() gives counts.
  bool has_counts() const { return has_counts_ || counts_file_ || count_of_all_ > 0; }
  /// Says so for files that do not: an EXR file of the same pixels, with one channel of whole numbers, or one that is
  /// named "samples": samples of all groups together, which then have the sizes of film/groups.h. Throws Error(kIo),
  /// and Error(kInput) where the file is not like that or the counts are known already.
  void take_counts(const std::string& path);
  /// The same number, > 0, for all pixels.
  void take_count(uint32_t samples);
  /// Attribute of covary's films: "crn", "independent"; "" for other files.
  const std::string& sampling() const { return sampling_; }
  /// Attributes of covary's films, "" for other files.
  const std::string& scene_hash() const { return scene_hash_; }
  const std::string& settings() const { return settings_; }
  /// A light film (film/splat_layer.h); an image to which one was added.
  bool is_light_film() const { return !light_paths_per_sample_.empty(); }
  bool has_light_added() const { return !light_film_.empty(); }
  /// Whether a channel has 16 bits only.
  bool has_half() const { return has_half_; }
  /// For messages.
  const std::string& name() const { return name_; }

  /// Rows of both arrays of a GroupedImage.
  struct Rows {
    std::vector<float> data;
    std::vector<uint32_t> counts;           ///< where has_counts(); empty otherwise, where groups must be equal
    std::vector<float> variance_in_groups;  ///< GroupedImage::variance_in_groups, of films that keep it
  };
  /// Rows [first_row, first_row + n_rows).
  void read_rows(int first_row, int n_rows, Rows& rows) const;
  /// These rows as an image.
  GroupedImage view(const Rows& rows, int n_rows) const;

 private:
  struct Group {
    size_t file;
    std::array<std::string, 3> channels;
  };
  void add_file(const std::string& path, const std::string& layer, bool only_file);
  /// What films of covary tell. Groups of one film follow from its counts; others must have equal numbers of samples.
  void take_film_facts(const std::string& path, const ExrFile& file, bool may_be_film);
  void read_counts(int first_row, int n_rows, std::vector<uint32_t>& counts) const;

  std::vector<std::unique_ptr<ExrFile>> files_;
  std::vector<Group> groups_;
  ImagePlace place_;
  double samples_ = 0, samples_of_group_ = 0;
  std::string sampling_, scene_hash_, settings_, light_paths_per_sample_, light_film_, name_;
  bool has_half_ = false, has_counts_ = false, has_variance_ = false;
  std::unique_ptr<ExrFile> counts_file_;
  std::string counts_path_, counts_channel_;
  uint32_t count_of_all_ = 0;
};

}  // namespace covary
