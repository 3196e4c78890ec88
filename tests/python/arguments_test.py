# SPDX-License-Identifier: Apache-2.0
"""Every argument of every public function: values that it does not take are refused with its name, the value and what
is accepted. An argument without such a value here, and a public function that is missing here, fails the test."""
import importlib
import inspect
import os
import re
import subprocess
import tempfile
import unittest
from pathlib import Path

import covary
import covary.blender
import covary.distributed
import covary.mitsuba
import numpy
from common import ROOM, PackageTest, noisy, pair

NO_NUMBERS = ("48", True, [1], None)
NO_TEXT = (3, True, ["x"], b"x")
NO_PATH = (3, True, ["x"], b"x", "")
NO_FLAG = (1, "yes", None)
NO_FUNCTION = (3, "print")
NO_TEXTS = (3, "x", {"a": 1}, {1: "a"})
NO_SCALARS = (3, "x", {"a": []}, {1: "a"}, {"a": float("nan")})
NO_IMAGE = (3, "x", [1.0], numpy.zeros((2, 2, 3)), numpy.zeros((2, 2), numpy.float32))
NO_GROUPS = (None, *NO_IMAGE)
NO_PICTURE = (None, 3, "x", [1.0], numpy.zeros((2, 2, 3), numpy.int32), numpy.zeros((2, 2), numpy.float32))
NO_SEED = (-1, 1 << 64, 0.5, *NO_NUMBERS)
NO_SPP = (-6, 0, 48.5, (1 << 30) + 1, numpy.int64(-3), float("nan"), float("inf"), *NO_NUMBERS)
NO_LIMIT = (-1, 0, float("nan"), float("inf"), "1", True, [1])


def without_none(values):
    return tuple(value for value in values if value is not None)


COMBINE = {"crn": without_none(NO_GROUPS), "independent": NO_GROUPS, "estimator": ("iicvv", "", *NO_TEXT),
           "light": (3, "x", [1]), "counts": (3, "x", [1], -numpy.ones((20, 24), int), numpy.ones((3, 3), int)),
           "samples": without_none(NO_SPP), "denoise": ("yes", "", *NO_TEXT), "albedo": without_none(NO_IMAGE),
           "normal": without_none(NO_IMAGE), "denoising_albedo": without_none(NO_IMAGE), "clean_features": NO_FLAG,
           "denoising_normal": without_none(NO_IMAGE), "position": without_none(NO_IMAGE),
           "layers": (3, "x", [1], {"a": 3}, {3: NO_IMAGE}), "oidn": ("/nowhere", *NO_TEXT),
           "device": ("gpu7", *NO_TEXT), "std_error": (1, "yes"), "force": NO_FLAG,
           "progress": NO_FUNCTION}
METRIC = {"image": NO_GROUPS, "reference": NO_GROUPS, "reference2": NO_IMAGE, "low_dynamic_range": NO_FLAG}
NO_SCENE = (3, None, [1])
RENDER = {"scene": (*NO_SCENE, ""), "spp": without_none(NO_SPP), "estimator": ("iicvv", *NO_TEXT),
          "integrator": ("pth", *NO_TEXT), "until": NO_LIMIT, "until_p95": NO_LIMIT,
          "until_relative": NO_LIMIT, "time": NO_LIMIT, "seed": NO_SEED,
          "denoise": ("yes", *NO_TEXT), "oidn": NO_TEXT, "device": ("gpu7", *NO_TEXT),
          "output": NO_PATH, "passes": NO_PATH, "resume": (True, *NO_FLAG),
          "overwrite": (True, *NO_FLAG), "checkpoint": (-1, 5, "1", True),
          "preview": (True, *NO_FLAG), "alpha": NO_FLAG, "aovs": NO_FLAG, "aov_samples": (0, -1, 2.5, "12"),
          "layers": ("dirct", *NO_TEXT),
          "crop": (3, "0,0,4,4", (0, 0, 4), (0, 0, 0, 0), (-1, 0, 4, 4), (0, 0, 4.5, 4), (0, 0, 400, 4)),
          "filter": ("bx", *NO_TEXT),
          "exposure": ("bright", [1]), "sampling": ("common", *NO_TEXT), "sampler": ("halton", *NO_TEXT),
          "groups": (0, -1, 1025, 2.5, "12"),
          "split": (1, "1:1", "half", (1,), (1, 0), (1, -1), ("1", 1)), "films_only": NO_FLAG, "save_training": NO_PATH,
          "load_training": NO_PATH, "live": (0, 70000, 1.5, "yes", None), "threads": (-1, 5000, 1.5, *NO_NUMBERS),
          "progress": NO_FUNCTION}
VIEW = {"resolution": (3, "36x24", (36,), (0, 24), (36, 24.5), (36, 70000), (36, "24")), "environment": NO_PATH,
        "background": ("x", (1, 2), (0, -1, 0)), "camera": (0, [1])}
#: By function and argument. What a value is refused for may also be found by the library.
BAD = {
    "covary.Scene.load": {
        "path": (None, *NO_PATH), **VIEW,
        "integrator": ("pth", None, *NO_TEXT), "min_depth": (-1, 1.5, "1", True), "max_depth": (-2, 1.5, "1", True),
        "integrator_options": (*NO_SCALARS, {"a": 1 << 63}), "defines": NO_SCALARS,
        "ignore_unknown": NO_FLAG},
    "covary.Scene.with_integrator": {"integrator": ("pth", None, *NO_TEXT)},
    "covary.render": {**RENDER, **VIEW},
    "covary.render_progressively": {"scene": (*NO_SCENE, ""), "spp": without_none(NO_SPP), "estimator": NO_TEXT},
    "covary.render_frames": {
        "scene": (*NO_PATH, None), "output": ("a.exr", None, *NO_PATH), "frames": (3, None, range(0), "x", "1-", [1]),
        **{name: RENDER[name] for name in ("spp", "estimator", "integrator", "until", "time", "seed", "denoise", "oidn",
                                           "aovs", "alpha", "aov_samples", "layers", "filter", "exposure", "sampling",
                                           "sampler", "groups", "save_training", "load_training", "threads",
                                           "progress")},
        **VIEW, "camera_path": NO_PATH, "fps": (0, "1", True), "history": NO_FLAG,
        "resume": NO_FLAG, "overwrite": NO_FLAG, "preview": NO_FLAG},
    "covary.set_threads": {"n": (-1, 5000, 1.5, *NO_NUMBERS)},
    "covary.combine": COMBINE,
    "covary.check_inputs": {"crn": without_none(NO_GROUPS), "independent": NO_GROUPS},
    "covary.read_image": {"path": (None, *NO_PATH), "layer": (None, "Albdo", *NO_TEXT), "accept_changed": NO_FLAG},
    "covary.write_image": {"path": ("x.webp", "x", None, *NO_PATH), "image": NO_PICTURE, "attributes": NO_TEXTS},
    "covary.read_groups": {"paths": (3, None, [], [3], "", [""]), "layer": (None, "Albdo", *NO_TEXT)},
    "covary.denoise": {"image": NO_GROUPS, "albedo": NO_IMAGE, "normal": NO_IMAGE, "oidn": ("/nowhere", *NO_TEXT)},
    "covary.Result.save": {"path": ("x.webp", "x", None, *NO_PATH), "overwrite": NO_FLAG},
    "covary.experiment": {"suite": (3, "quik", ""), "output": (None, *NO_PATH), "methods": (3, {"a": 3}),
                          "renderers": (3, {"a": 3}),
                          "scenes": NO_PATH, "options": (3, "--quick", [3]), "progress": NO_FUNCTION},
    "covary.Samples.layer": {"name": ("Albdo", *NO_TEXT)}, "covary.Samples.film": {"name": ("nothing", *NO_TEXT)},
    "covary.Result.plot": {"exposure": ("1", True, float("nan")), "axes": (3, "x")},
    "covary.Experiment.plot": {"axes": (3, "x")}, "covary.Result.to_dict": {},
    "covary.Film.load": {"path": (None, *NO_PATH)},
    "covary.Film.save": {"path": (None, *NO_PATH)},
    "covary.Film.attributes": {"attributes": (None, *NO_TEXTS)},
    "covary.merge_films": {"films": (3, "x.exr", None, [3], [])},
    "covary.film_from_groups": {"groups": NO_GROUPS, "samples": NO_SPP, "sampling": ("common", None, *NO_TEXT),
                                "seed": without_none(NO_SEED), "attributes": NO_TEXTS},
    "covary.View.save": {"path": (None, *NO_PATH)},
    "covary.view": {"images": (3, [3], {"a/b": numpy.zeros((2, 2, 3), numpy.float32)}), "reference": (3,),
                    "title": (None, *NO_TEXT), "height": (0, 0.5, *NO_NUMBERS), "small": NO_FLAG},
    "covary.metrics.compute": {"name": ("relmsee", None, *NO_TEXT), **METRIC, "denominator": NO_IMAGE},
    **{f"covary.metrics.{metric['name'].replace('-', '_')}": METRIC for metric in covary._covary.metrics()},
    "covary.scenes.path": {"name": ("rom", None, "../room", *NO_TEXT)},
    "covary.distributed.render": {
        "client": (None, 3, "tcp://x"), "scene": NO_SCENE, "spp": NO_SPP, "estimator": ("dependent-tests", 3),
        "seed": NO_SEED, "sample_ranges": (0, 7, 1.5, *NO_NUMBERS), "tile": (0, 2.5, *NO_NUMBERS), "folder": NO_PATH,
        "progress": NO_FUNCTION, "on_image": NO_FUNCTION, "image_seconds": (-1, *NO_NUMBERS),
        "settings": (3, {"x": 1}, {"filter": "bx"}, {"groups": 2.5})},
    "covary.distributed.experiment": {
        "client": (None, 3), "suite": (None, *NO_PATH), "output": (None, *NO_PATH), "arguments": (3, "--quick", [3]),
        "progress": NO_FUNCTION},
    "covary.distributed.frames": {
        "client": (None, 3), "scene": (None, *NO_PATH), "output": (None, *NO_PATH), "first": (-1, 0.5, *NO_NUMBERS),
        "last": (-1, 0.5, *NO_NUMBERS), "options": (3, "--spp", [3]), "waves": (0, 1001, 1.5, *NO_NUMBERS),
        "seed": (-1, 10**6, *NO_NUMBERS), "progress": NO_FUNCTION},
    "covary.distributed.main": {"words": (3, "x", [3])},
    "covary.distributed.SceneFiles": {"scene": ("room.xml", None)},
    "covary.mitsuba.render": {
        "scene": NO_SCENE, "spp": NO_SPP, "seed": NO_SEED, "integrator": (3, ["path"]), "sensor": (-1, 0.5, "0"),
        "groups": (2, 0, 2.5, "12", None), "estimator": ("iicvv", None, *NO_TEXT), "aovs": NO_FLAG,
        "progress": NO_FUNCTION},
    "covary.blender.render": {
        "scene": (3, "Scene"), "spp": NO_SPP, "seed": NO_SEED, "groups": (2, 0, 2.5, "12", None),
        "estimator": ("iicvv", None, *NO_TEXT), "change": NO_FLAG, "progress": NO_FUNCTION},
    "covary.blender.show": {"result": (3, None), "name": (None, *NO_TEXT)},
    "covary.blender.changes": {"scene": (3, None)},
}
#: Classes that results are made of, which nobody calls, errors, and functions without arguments of ours.
NOT_CALLED = ("Error", "Warning", "Result", "Report", "BadSample", "Scene", "Film", "View", "Experiment", "Samples",
              "Step")
WITHOUT_ARGUMENTS = ("program", "names", "line", "tqdm")


def public_functions():
    """Those of the modules, by their full names, and their parameters."""
    places = [("covary", covary, covary.__all__)]
    for name in ("metrics", "scenes", "distributed", "mitsuba", "blender", "progress"):
        module = importlib.import_module(f"covary.{name}")
        own = [key for key, value in vars(module).items() if not key.startswith("_") and callable(value)
               and getattr(value, "__module__", "") == module.__name__]
        places.append((module.__name__, module, getattr(module, "__all__", own)))
    for place, module, names in places:
        for name in names:
            if callable(getattr(module, name)) and not name.endswith(NOT_CALLED) and name not in WITHOUT_ARGUMENTS:
                yield f"{place}.{name}", getattr(module, name)
    for cls in (covary.Scene, covary.Result, covary.Samples, covary.Experiment, covary.View, covary.Film):
        for name, value in inspect.getmembers(cls, callable):
            if not name.startswith("_"):
                yield f"covary.{cls.__name__}.{name}", value


def parameters(function):
    if type(function).__module__.startswith("nanobind"):  # Python 3.13 invents a signature for these: their text has it
        return re.findall(r"(\w+): ", function.__doc__.partition(")")[0])
    return [name for name, parameter in inspect.signature(function).parameters.items()
            if name != "self" and parameter.kind is not parameter.VAR_KEYWORD]


class Arguments(PackageTest):
    @classmethod
    def setUpClass(cls):
        cls.scene = covary.Scene.load(ROOM, resolution=(24, 20))
        cls.result = covary.render(cls.scene, 24, "iicv")
        cls.film = cls.result.films["crn"]
        cls.crn, cls.independent = pair()

    def good(self, function):
        """Arguments with which it would work, and the function, bound to an object where it belongs to one."""
        image = noisy(3, False)[0]
        exr = str(self.path / "image.exr")
        self.samples = covary.Samples(exr, str(self.path), str(ROOM), 1, 8, None)
        covary.write_image(exr, image)
        bound = {"covary.Scene.with_integrator": self.scene.with_integrator, "covary.Result.save": self.result.save,
                 "covary.Result.plot": self.result.plot, "covary.Result.to_dict": self.result.to_dict,
                 "covary.Experiment.plot": covary.Experiment(self.path, {"cells": []}).plot,
                 "covary.Samples.layer": self.samples.layer, "covary.Samples.film": self.samples.film,
                 "covary.Film.load": covary.Film.load, "covary.Film.save": self.film.save,
                 "covary.Film.attributes": lambda attributes: setattr(self.film, "attributes", attributes),
                 "covary.View.save": covary.View("", 1).save}
        of_pair = {"crn": self.crn, "independent": self.independent}
        of_metric = {"image": image, "reference": image}
        given = {"covary.Scene.load": {"path": ROOM}, "covary.render": {"scene": self.scene, "spp": 8},
                 "covary.render_progressively": {"scene": self.scene, "spp": 8},
                 "covary.combine": of_pair, "covary.check_inputs": of_pair, "covary.read_image": {"path": exr},
                 "covary.write_image": {"path": exr, "image": image}, "covary.read_groups": {"paths": [exr]},
                 "covary.denoise": {"image": image}, "covary.film_from_groups": {"groups": self.crn, "samples": 24},
                 "covary.view": {"images": image},
                 "covary.render_frames": {"scene": ROOM, "output": "f_#.exr", "frames": "1"},
                 "covary.experiment": {"suite": "quick", "output": self.path / "out"},
                 "covary.metrics.compute": {"name": "relmse", **of_metric, "reference2": image},
                 "covary.Result.save": {"path": self.path / "saved.png"},
                 "covary.distributed.render": {"client": Client(), "scene": self.scene, "spp": 24},
                 "covary.distributed.experiment": {"client": Client(), "suite": "iicv-table1", "output": "out"},
                 "covary.distributed.frames": {"client": Client(), "scene": ROOM, "output": "f_#.exr", "first": 1,
                                               "last": 2},
                 "covary.mitsuba.render": {"scene": "x.xml", "spp": 24},
                 "covary.blender.render": {"spp": 24}, "covary.blender.show": {"result": self.result}}
        if function.startswith("covary.metrics.") and function not in given:
            return named(function), dict(of_metric)
        return bound.get(function) or named(function), dict(given.get(function, {}))

    def test_every_public_function_and_argument_is_here(self):
        estimators = {f"covary.{name}" for name in covary.estimators.__all__}
        found = {name: parameters(function) for name, function in public_functions() if name not in estimators}
        found["covary.Film.attributes"] = ["attributes"]
        self.assertEqual({name: sorted(names) for name, names in found.items()},
                         {name: sorted(values) for name, values in BAD.items()})

    def beside(self, function, name):
        """What must be given, too, so that the argument has an effect."""
        if not function.startswith("covary.") or function.count(".") > 1 or function == "covary.denoise":
            return {}
        features = {"denoise": "balanced", "oidn": "off"}
        return {"albedo": features, "normal": {**features, "albedo": self.crn[0]}, "denoising_albedo": features,
                "denoising_normal": {**features, "denoising_albedo": self.crn[0]},
                "position": {**features, "albedo": self.crn[0]}, "oidn": {"denoise": "balanced"},
                "counts": {"samples": 24}}.get(name, {})

    def refused(self, function, call, given, name, value):
        """Raises one of the right kind, whose text has the argument's name and the value."""
        given = {**given, **self.beside(function, name)}
        with self.subTest(function=function, argument=name, value=repr(value)[:60]):
            with self.assertRaises((TypeError, ValueError, covary.Error)) as raised:
                call(**{**given, name: value})
            text = str(raised.exception)
            self.assertNotIn("incompatible function arguments", text)
            self.assertNotIn("bad_cast", text)
            long_value = isinstance(value, str) and len(value) > 3 and value in text  # which tells as much
            self.assertTrue(name in text or name.replace("_", "-") in text or long_value, text)
            self.assertTrue(repr(value) in text or str(value) in text or type(value).__name__ in text or
                            isinstance(value, (tuple, list, dict, numpy.ndarray)), text)

    def test_bad_values_are_refused(self):
        for function, arguments in BAD.items():
            call, given = self.good(function)
            for name, values in arguments.items():
                self.assertTrue(values)
                for value in values:
                    self.refused(function, call, given, name, value)

    def test_estimators(self):
        """Of the registry, with their options."""
        kinds = {"flag": NO_FLAG[:2], "whole": (2.5, "9", True, [9]), "real": ("0.5", True, [1.0], float("nan")),
                 "choice": ("nonsense", 3, True)}
        for estimator in covary._covary.estimators():
            if estimator["passes"] != "pair":
                continue
            name = estimator["name"].replace("-", "_")
            call = getattr(covary, name)
            options = {option["name"].replace("-", "_"): kinds[option["type"]] for option in estimator["options"]}
            for argument in parameters(call):
                more = {"samples": 24} if name == "iduw" and argument != "samples" else {}
                for value in options.get(argument) or COMBINE[argument]:
                    self.refused(f"covary.{name}", call, {"crn": self.crn, "independent": self.independent, **more},
                                 argument, value)

    def test_whole_numbers_of_any_kind(self):
        images = [covary.render(self.scene, spp).image for spp in (8, 8.0, numpy.int32(8), numpy.float64(8))]
        for image in images[1:]:
            self.assert_same_bits(images[0], image)

    def test_arguments_of_the_scene(self):
        message = self.message_of(covary.UsageError, covary.render, self.scene, 8, resolution=(24, 20), camera=1)
        self.assertIn("resolution, camera: the scene is loaded already; give it to Scene.load('", message)
        self.assertIn("room.xml', resolution=(24, 20), camera=1)", message)
        message = self.message_of(covary.UsageError, covary.render, ROOM, 8, max_depth=3)
        self.assertIn("max_depth: not of render(), but of Scene.load(): render(Scene.load('", message)
        seen = covary.render(ROOM, 8, resolution=(24, 20), environment="white", background=(0, 1, 0), camera=1).image
        loaded = covary.Scene.load(ROOM, resolution=(24, 20), environment="white", background=(0, 1, 0), camera=1)
        self.assertEqual(seen.shape, (20, 24, 3))
        self.assert_same_bits(seen, covary.render(loaded, 8).image)
        self.assertIn("resolution: found '24x20' (str); expected (width, height)",
                      self.message_of(TypeError, covary.render, ROOM, 8, resolution="24x20"))

    def test_rules_cover_the_arguments(self):
        from covary._arguments import checked, flag
        self.assertIn("the rules are of ['b'], the arguments ['a']", self.message_of(
            TypeError, checked(b=flag), lambda a: a))

    def test_options_of_rendering_are_arguments(self):
        """All that the library declares, under their names; these differ."""
        declared = {option["name"].replace("-", "_") for option in covary._covary.render_options()}
        other = {"rfilter": "filter", "no_preview": "preview"}
        taken = set(inspect.signature(covary.render).parameters) - {"scene", "options", "films_only", "live", "threads",
                                                                    "progress", "until_p95", "until_relative"}
        self.assertEqual({other.get(name, name) for name in declared}, taken)
        of_scene = {"resolution", "environment", "background", "camera"}
        for call in (covary.Scene.load, covary.render, covary.render_frames):
            self.assertLessEqual(of_scene, set(inspect.signature(call).parameters))
        own = inspect.signature(inspect.unwrap(covary.render)).parameters
        for name, parameter in inspect.signature(covary.render).parameters.items():
            self.assertIsNot(parameter.annotation, parameter.empty, name)
            lines = re.findall(rf"^(?:.*[ ,])?{name}[,:]", covary.render.__doc__, re.M)
            if name not in own:  # as declared
                self.assertEqual(lines, [f"{name}:"])
                self.assertIn(parameter.default, (None, False))

    def test_types_of_options_are_shown(self):
        shown = inspect.signature(covary.render).parameters
        self.assertEqual({name: shown[name].annotation for name in ("aovs", "groups", "sampler", "exposure")},
                         {"aovs": "bool", "groups": "int | None", "exposure": "float | None",
                          "sampler": "Literal['independent', 'sobol'] | None"})

    def test_misspelt_arguments(self):
        for call in (covary.render, lambda *scene, **given: covary.render_frames(*scene, "a_#.exr", "1", **given)):
            self.assertIn("theads: there is no such argument; did you mean threads?",
                          self.message_of(covary.UsageError, call, ROOM, theads=2))
        self.assertIn("windwo is not an option of any estimator; did you mean 'window'?",
                      self.message_of(covary.UsageError, covary.render, ROOM, 24, "iicv", windwo=3))
        self.assertRegex(self.message_of(covary.IoError, covary.render, "rom"), "cannot read 'rom': there is no such "
                         "file, and covary comes with no scene of that name, but with .*room")

    def test_options_of_combining_are_arguments(self):
        """All that the library declares, under their names but for these; features are five images and a word
        on them, and some options are of files and of the program alone."""
        declared = {option["name"].replace("-", "_"): option for option in covary._covary.combine_options()}
        other = {"error": ["std_error"], "features": ["albedo", "normal", "denoising_albedo", "denoising_normal",
                                                  "position", "clean_features"]}
        files = {"output", "crn_layer", "independent_layer", "explain", "memory"}
        arguments = inspect.signature(covary.combine).parameters
        self.assertEqual({name for option in declared if option not in files for name in other.get(option, [option])},
                         set(arguments) - {"options", "progress"})
        for name in ("estimator", "oidn"):
            self.assertEqual(declared[name]["default"], arguments[name].default)
        self.assertIsNone(arguments["denoise"].default, "as the estimator has it")
        words = subprocess.run([os.environ["COVARY_PROGRAM"], "combine", "--help-all"], capture_output=True, text=True,
                               check=True).stdout
        for name in declared:
            self.assertRegex(words, rf"\n +(-o, )?--{name.replace('_', '-')}[ ,\n]")

    def test_options_of_integrators_are_those_of_scene_files(self):
        """Each with its default, in both."""
        room = Path(ROOM).read_text()
        kinds = {"whole": "integer", "real": "float", "choice": "string"}
        for integrator, options in covary._covary.integrator_options().items():
            self.assertGreaterEqual(len(options), 4)
            for option in options:
                name, value = option["name"].replace("-", "_"), option["default"]
                is_switch = option["type"] == "flag" or option["choices"] == ["on", "off"]
                kind = "boolean" if is_switch else "string" if value in option["choices"] else kinds[option["type"]]
                value = {"on": "true", "": "false", "off": "false"}[value] if is_switch else value
                element = f'<integrator type="{integrator}"><{kind} name="{name}" value="{value}"/></integrator>'
                with self.subTest(element), tempfile.TemporaryDirectory() as folder:
                    file = Path(folder, "scene.xml")
                    file.write_text(re.sub("<integrator.*?</integrator>", element, room, count=1, flags=re.S))
                    covary.Scene.load(file)
                    given = {name: value == "true" if is_switch else value}
                    try:
                        covary.Scene.load(ROOM, integrator=integrator, integrator_options=given)
                    except covary.UsageError as error:  # where it needs another one
                        self.assertIn("has no effect with", str(error))


class Client:
    """What checks of arguments take for one of Dask."""

    submit = register_plugin = None


def named(function):
    place = covary
    for name in function.split(".")[1:]:
        place = getattr(place, name)
    return place


if __name__ == "__main__":
    unittest.main()
