// SPDX-License-Identifier: Apache-2.0
#include "film/film.h"

#include <algorithm>

#include "core/error.h"
#include "film/film_file.h"
#include "film/merge.h"
#include "python/module/arrays.h"
#include "python/module/bindings.h"
#include "python/module/work.h"

namespace covary::python {
namespace {

using Attributes = std::map<std::string, std::string>;

/// The name, checked by the rule of Python's functions.
std::string checked_path(nb::handle path) {
  return nb::cast<std::string>(nb::module_::import_("covary._arguments").attr("path")("path", path));
}

Film load(nb::handle path) {
  const std::string name = checked_path(path);
  Film film;
  run_work([&](WorkState&) { film = read_film(name); }, nb::none());
  return film;
}

void save(const Film& film, nb::handle path) {
  const std::string name = checked_path(path);
  run_work([&](WorkState&) { write_film(name, film); }, nb::none());
}

void set_attributes(Film& film, nb::handle attributes) {
  film.attributes =
      nb::cast<Attributes>(nb::module_::import_("covary._arguments").attr("attribute_texts")("attributes", attributes));
}

Film merge(const std::vector<const Film*>& films) {
  if (films.empty()) throw nb::value_error("films: found none; one or more are needed");
  std::vector<Film> copies;
  std::vector<std::string> names;
  for (const Film* film : films) {
    names.push_back("film " + std::to_string(copies.size()));
    copies.push_back(*film);
  }
  Film merged;
  run_work([&](WorkState&) { merged = merge_films(copies, names); }, nb::none());
  return merged;
}

Film merge_files(const std::vector<std::string>& paths) {
  Film merged;
  run_work([&](WorkState&) { merged = merge_film_files(paths); }, nb::none());
  return merged;
}

Film from_groups(nb::object groups, uint32_t samples, const Attributes& attributes) {
  Groups source(groups, "groups");
  Film film;
  run_work(
      [&](WorkState&) {
        const GroupedImage image = source.view();
        if (samples < static_cast<uint32_t>(image.groups))
          throw Error(ErrorCode::kUsage, "samples: each of the " + std::to_string(image.groups) +
                                             " groups needs one or more; found " + std::to_string(samples));
        film = Film(image.width, image.height, {0, 0, image.width, image.height}, image.groups);
        film.data().assign(image.data, image.data + film.data().size());
        std::fill(film.counts().begin(), film.counts().end(), samples);
        film.attributes = attributes;
      },
      nb::none());
  return film;
}

/// A view of the film's memory, which keeps the film alive.
nb::object groups_of(nb::handle self) {
  const Film& film = nb::cast<const Film&>(self);
  const auto T = static_cast<size_t>(film.groups()), W = static_cast<size_t>(film.width());
  const int64_t stride = static_cast<int64_t>(T) * 3;
  return nb::cast(nb::ndarray<nb::numpy, const float, nb::ndim<4>>(film.data().data(),
                                                                   {T, static_cast<size_t>(film.height()), W, 3}, self,
                                                                   {3, static_cast<int64_t>(W) * stride, stride, 1}));
}

nb::object counts_of(nb::handle self) {
  const Film& film = nb::cast<const Film&>(self);
  return nb::cast(nb::ndarray<nb::numpy, const uint32_t, nb::ndim<2>>(
      film.counts().data(), {static_cast<size_t>(film.height()), static_cast<size_t>(film.width())}, self));
}

/// The group means in their memory order, [H, W, T, 3].
nb::object memory_of(nb::handle self) {
  const Film& film = nb::cast<const Film&>(self);
  return nb::cast(nb::ndarray<nb::numpy, const float, nb::ndim<4>>(
      film.data().data(),
      {static_cast<size_t>(film.height()), static_cast<size_t>(film.width()), static_cast<size_t>(film.groups()), 3},
      self));
}

/// A film of arrays [H, W, T, 3] and [H, W].
Film from_parts(std::pair<int, int> frame, std::array<int, 4> crop, nb::object values, nb::object counts,
                const Attributes& attributes) {
  const auto groups = nb::cast<nb::ndarray<const float, nb::ndim<4>, nb::c_contig, nb::device::cpu>>(values);
  const auto samples = nb::cast<nb::ndarray<const uint32_t, nb::ndim<2>, nb::c_contig, nb::device::cpu>>(counts);
  Film film(frame.first, frame.second, {crop[0], crop[1], crop[2], crop[3]}, static_cast<int>(groups.shape(2)));
  if (groups.size() != film.data().size() || samples.size() != film.counts().size())
    throw nb::value_error("the arrays of a film do not have the size of its crop");
  film.data().assign(groups.data(), groups.data() + groups.size());
  film.counts().assign(samples.data(), samples.data() + samples.size());
  film.attributes = attributes;
  return film;
}

/// How pickle takes a film to another process.
nb::tuple reduced(nb::handle self) {
  const Film& film = nb::cast<const Film&>(self);
  if (film.keeps_sample_variance() || !film.aovs.empty())
    throw nb::type_error(
        "a film that keeps the variance of its samples, or auxiliary images, cannot be pickled; save() writes it");
  const CropWindow& c = film.crop();
  return nb::make_tuple(
      nb::module_::import_("covary.film").attr("_from_parts"),
      nb::make_tuple(std::pair(film.frame_width(), film.frame_height()), std::array{c.x, c.y, c.width, c.height},
                     memory_of(self), counts_of(self), film.attributes));
}

nb::dict aovs_of(const Film& film) {
  nb::dict d;
  for (const auto& [name, image] : film.aovs) d[name.c_str()] = array_of(Image(image));
  return d;
}

}  // namespace

void bind_film(nb::module_& module) {
  using namespace nb::literals;
  nb::class_<Film>(module, "Film",
                   "What a render pass leaves behind: for each pixel the number of samples, and the means of T groups "
                   "of them. Writing a film and reading it gives the same bits.")
      .def_static("load", &load, "path"_a.none(), nb::sig("def load(path: str | os.PathLike[str]) -> Film"),
                  "Reads a film that covary wrote.")
      .def("save", &save, "path"_a.none(), nb::sig("def save(self, path: str | os.PathLike[str]) -> None"),
           "Writes the film (EXR); the file appears under its name only when complete.")
      .def_static("_merge", &merge, "films"_a, nb::sig("def _merge(films: list[Film]) -> Film"))
      .def_static("_merge_files", &merge_files, "paths"_a, nb::sig("def _merge_files(paths: list[str]) -> Film"))
      .def_static("_from_groups", &from_groups, "groups"_a.none(), "samples"_a, "attributes"_a,
                  nb::sig("def _from_groups(groups: object, samples: int, attributes: dict[str, str]) -> Film"))
      .def_static("_from_parts", &from_parts, "frame"_a, "crop"_a, "groups"_a, "counts"_a, "attributes"_a,
                  nb::sig("def _from_parts(frame: tuple[int, int], crop: tuple[int, int, int, int], groups: object, "
                          "counts: object, attributes: dict[str, str]) -> Film"))
      .def("__reduce__", &reduced, nb::sig("def __reduce__(self) -> tuple[typing.Any, ...]"))
      .def_prop_ro("groups", &groups_of, nb::sig("def groups(self) -> numpy.typing.NDArray[numpy.float32]"),
                   "The group means, [T, H, W, 3]: a read-only view of the film's memory.")
      .def_prop_ro("counts", &counts_of, nb::sig("def counts(self) -> numpy.typing.NDArray[numpy.uint32]"),
                   "Samples of each pixel, all groups together, [H, W]: a read-only view.")
      .def_prop_ro(
          "mean", [](const Film& film) { return array_of(film.mean_image()); },
          nb::sig("def mean(self) -> numpy.typing.NDArray[numpy.float32]"), "The mean of all samples, [H, W, 3].")
      .def_prop_ro("aovs", &aovs_of, nb::sig("def aovs(self) -> dict[str, numpy.typing.NDArray[numpy.float32]]"),
                   "Auxiliary images by name ('Albedo', 'N', 'P'), [H, W, 3].")
      .def_prop_ro("width", &Film::width, "Pixels of the film, which may be a part of the frame.")
      .def_prop_ro("height", &Film::height)
      .def_prop_ro(
          "frame", [](const Film& f) { return std::pair(f.frame_width(), f.frame_height()); },
          "Width and height of the full frame.")
      .def_prop_ro(
          "crop",
          [](const Film& f) {
            return std::array{f.crop().x, f.crop().y, f.crop().width, f.crop().height};
          },
          "x, y, width and height of the film's pixels in the frame.")
      .def_prop_ro("samples_per_pixel", &Film::mean_count, "Mean over the film.")
      .def_prop_rw(
          "attributes", [](const Film& film) { return film.attributes; }, &set_attributes,
          nb::for_getter(nb::sig("def attributes(self) -> dict[str, str]")),
          nb::for_setter(nb::sig("def attributes(self, attributes: dict[str, str], /) -> None")),
          nb::for_setter(nb::arg("attributes").none()), "Facts that travel with the file, as text: seed, sampling, ….")
      .def("__repr__", [](const Film& f) {
        return "<covary.Film " + std::to_string(f.width()) + " x " + std::to_string(f.height()) + ", " +
               std::to_string(f.groups()) + " groups>";
      });
}

}  // namespace covary::python
