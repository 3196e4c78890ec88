// SPDX-License-Identifier: Apache-2.0
// Grouped images in EXR files of any renderer: films of covary, one file with a layer per group, or one file per group
// as written by Mitsuba 3, pbrt-v4 and Blender. Rows are read on demand, so that memory is independent of the image
// height.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "combine/result_source.h"
#include "film/exr.h"
#include "film/grouped_image.h"
#include "film/written_by.h"

namespace covary {

class GroupedFile {
 public:
  /// One path: all groups, as layers whose names differ in a number (group00.R, group00.G, …), or a single image.
  /// Several paths: one image each, giving the groups in that order. If a file has several images, `layer` names one
  /// (groups without their number), or else the picture is used (film/pictures.h). Numbered layers of other names than
  /// "group" are groups only if they are named, or if there are no other colours. Throws Error(kIo), and Error(kInput)
  /// listing the layers found, with `option`, the argument that names one.
  explicit GroupedFile(const std::vector<std::string>& paths, const std::string& layer = "",
                       const std::string& option = "--layer");

  int width() const { return place_.window.width; }
  int height() const { return place_.window.height; }
  const ImagePlace& place() const { return place_; }
  /// Of the channels that are read.
  ColourSpace colours() const;
  int groups() const { return static_cast<int>(groups_.size()); }
  std::string groups_text() const;  ///< "2 renders", or "12 groups" of one file
  Renderer renderer() const;        ///< that made the first file
  /// Samples per pixel of all groups together, averaged over pixels; 0 if the files do not say.
  double samples() const { return samples_; }
  /// Whether the number of samples of each pixel is known, so that read_rows() gives counts.
  bool has_counts() const { return has_counts_ || counts_file_ || count_of_all_ > 0; }
  /// Sets the counts for files without them: an EXR file of the same pixels with one channel of whole numbers, or one
  /// named "samples": total samples of all groups, which then have the sizes of film/groups.h. Throws Error(kIo), and
  /// Error(kInput) if the file does not match or the counts are already known.
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
  /// Whether all groups are of one film of covary.
  bool is_one_film() const { return is_one_film_; }
  /// denoised_by() of the first such file; "" for films.
  const std::string& denoised() const { return denoised_; }
  /// Whether any channel has only 16 bits.
  bool has_half() const { return has_half_; }
  /// For messages.
  const std::string& name() const { return name_; }
  /// Where an image made of the groups goes in a new version of the first file.
  const ResultSource& source() const { return source_; }

  /// Rows of both arrays of a GroupedImage.
  struct Rows {
    std::vector<float> data;
    std::vector<uint32_t> counts;           ///< if has_counts(); otherwise empty, and groups are equal
    std::vector<float> variance_in_groups;  ///< GroupedImage::variance_in_groups, for films that keep it
  };
  /// Rows [first_row, first_row + n_rows).
  void read_rows(int first_row, int n_rows, Rows& rows) const;
  /// These rows as an image.
  GroupedImage view(const Rows& rows, int n_rows) const;

 private:
  struct Group {
    size_t file;
    std::array<std::string, 3> channels;
    bool is_grey() const { return channels[0] == channels[2]; }
  };
  void add_file(const std::string& path, const std::string& layer, bool only_file);
  /// Reads metadata of covary's films. The groups of one film follow from its counts; other groups must have equal
  /// numbers of samples.
  void take_film_facts(const std::string& path, const ExrFile& file, bool may_be_film);
  void read_counts(int first_row, int n_rows, std::vector<uint32_t>& counts) const;

  std::vector<std::unique_ptr<ExrFile>> files_;
  std::vector<Group> groups_;
  ResultSource source_;
  ImagePlace place_;
  double samples_ = 0, samples_of_group_ = 0;
  std::string layer_option_, sampling_, scene_hash_, settings_, light_paths_per_sample_, light_film_, name_, denoised_;
  bool has_half_ = false, has_counts_ = false, has_variance_ = false, is_one_film_ = false;
  std::unique_ptr<ExrFile> counts_file_;
  std::string counts_path_, counts_channel_;
  uint32_t count_of_all_ = 0;
};

}  // namespace covary
