# SPDX-License-Identifier: Apache-2.0
"""make_modules.py PACKAGE: writes estimators.py, metrics.py, _keywords.py and _covary.pyi into the folder PACKAGE,
which holds the extension module, from the registries that this was built with. So each estimator and metric is a
function with types and a docstring, and none has to be written by hand."""
import ast
import importlib.util
import keyword
import sys
import textwrap
from pathlib import Path

HEAD = '''# SPDX-License-Identifier: Apache-2.0
"""{}

Made by python/make_modules.py from the registry."""
from __future__ import annotations

from typing import TYPE_CHECKING, Any{}

{}
'''


def load_extension(package):
    path = next(package.glob("_covary*.so"))
    spec = importlib.util.spec_from_file_location("_covary", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def identifier(name):
    name = name.replace("-", "_")
    return name + "_" if keyword.iskeyword(name) else name


def wrapped(text, indent):
    return "\n".join(textwrap.wrap(text, 120, initial_indent=indent, subsequent_indent=indent + "    "))


def literal(names):
    return f"Literal[{', '.join(repr(name) for name in names)}]"


def type_and_default(option):
    """Type and default of the keyword argument. Options that are not given, None, are not passed on, because an option
    may change another's default; flags are off."""
    if option["type"] == "flag":
        return "bool", "False"
    text = "str | PathLike[str]" if option["is_path"] else "str"
    python_type = {"whole": "int", "real": "float", "choice": literal(option["choices"]), "text": text}[option["type"]]
    return f"{python_type} | None", "None"


def option_line(option):
    about = [option["range"]] if option["type"] in ("whole", "real") and option["range"] else []
    about += [f"default {option['default']}"] if option["default"] else []
    note = f" ({'; '.join(about)})" if about else ""
    return wrapped(f"{identifier(option['name'])}: {option['help']}{note}.", "    ")


def listed(first, items, last):
    """Items separated by commas, wrapped at 120 columns and aligned with the opening bracket at the end of `first`."""
    lines, indent = [first], " " * len(first)
    for number, item in enumerate(items):
        text = item + (last if number + 1 == len(items) else ",")
        if len(lines[-1]) + len(text) + 1 > 120:
            lines.append(indent)
        lines[-1] += text if lines[-1] in (first, indent) else " " + text
    return "\n".join(lines)


def signature(name, fixed, options):
    arguments = [f"{identifier(o['name'])}: {t} = {d}" for o in options for t, d in [type_and_default(o)]]
    return listed(f"def {name}(", [*fixed, *arguments], ") -> Result:")


def combine_options(estimator):
    """The options without those that only say how passes are rendered."""
    return [option for option in estimator["options"] if not option["of_passes"]]


def estimator_function(estimator):
    options = combine_options(estimator)
    fixed = ["crn: Any", "independent: Any", "*", "light: Film | None = None", "counts: Any = None",
             "samples: int | None = None", "force: bool = False", "progress: Progress | None = None"]
    passed = ["light=light", "counts=counts", "samples=samples", "force=force", "progress=progress"]
    if estimator["denoises"]:
        fixed += ['denoise: DenoiseMode = "none"', "albedo: Any = None", "normal: Any = None",
                  'oidn: str | PathLike[str] = ""']
        passed += ["denoise=denoise", "albedo=albedo", "normal=normal", "oidn=oidn"]
    if estimator["predicts_error"]:
        fixed.append("std_error: bool | None = None")
        passed.append("std_error=std_error")
    passed += [f"{identifier(o['name'])}={identifier(o['name'])}" for o in options]
    name = identifier(estimator["name"])
    summary = f"{name}: {estimator['summary']}; at least {estimator['min_groups']} groups."
    call = listed("    return combine(", ["crn", "independent", repr(estimator["name"]), *passed], ")")
    return "\n".join([
        signature(name, fixed, options),
        wrapped(f'"""{summary}', "    "), "",
        "    combine() says what crn, independent and the other arguments are.", "",
        *map(option_line, options), '    """', call])


def estimators_module(estimators):
    pairs = [e for e in estimators if e["passes"] == "pair"]
    head = HEAD.format("The estimators of two images by name, with their options.", ", Literal",
                       "from ._combine import combine\n\nif TYPE_CHECKING:\n    from os import PathLike\n\n"
                       "    from ._keywords import DenoiseMode\n"
                       "    from ._result import Result\n"
                       "    from .film import Film\n    from .progress import Progress\n")
    names = sorted([identifier(e["name"]) for e in pairs])
    of_pairs = [e["name"] for e in estimators if e["is_default"] or e in pairs]
    types = [f"#: Estimators of two images.\nPairEstimator = {literal(of_pairs)}",
             f"#: Those of render().\nEstimator = {literal([e['name'] for e in estimators])}"]
    return "\n".join([head, f"__all__ = {names!r}", "", *types, *(f"\n\n{estimator_function(e)}" for e in pairs), ""])


def keywords_of_render(source):
    """The arguments of render() that have to be named, with their types."""
    functions = [node for node in ast.parse(source).body if isinstance(node, ast.FunctionDef)]
    render = next(function for function in functions if function.name == "render")
    return {argument.arg: ast.unparse(argument.annotation) for argument in render.args.kwonlyargs}


#: Types of arguments that several functions have, and the options whose choices they are.
NAMED_CHOICES = {"DenoiseMode": "denoise", "Filter": "rfilter"}


#: Options of render() that are arguments under another name, or of Scene.load().
UNDER_OTHER_NAMES = {"estimator", "spp", "no_preview", "rfilter", "resolution", "background", "camera",
                     "environment"}
#: What functions take for the image of rendered samples, besides the estimator's options.
OF_THE_IMAGE = {"denoise": "DenoiseMode | None", "oidn": "str | PathLike[str]", "force": "bool",
                "std_error": "bool | None"}


def types_of(options):
    """Types of keywords by name; one name may be an option of several estimators."""
    types = {}
    for option in options:
        types.setdefault(identifier(option["name"]), set()).update(type_and_default(option)[0].split(" | "))
    return {name: " | ".join(sorted(kinds, key=lambda kind: (kind == "None", kind)))
            for name, kinds in sorted(types.items())}


def typed_dict(name, about, types, base="TypedDict"):
    lines = "\n".join(wrapped(f"{keyword}: {kind}", "    ") for keyword, kind in types.items())
    return f'class {name}({base}, total=False):\n    """{about}"""\n\n{lines}\n'


def keywords_module(render_options, estimators, own):
    """For type checkers: the keywords that functions take as declared options, besides their own arguments."""
    pairs = [option for estimator in estimators if estimator["passes"] == "pair"
             for option in combine_options(estimator)]
    every = [*render_options, *(option for estimator in estimators for option in estimator["options"])]
    of_render = {name: kind for name, kind in types_of(every).items() if name not in {*own, *UNDER_OTHER_NAMES}}
    head = HEAD.format("Keywords of functions that take options.", ", Literal, TypedDict",
                       "if TYPE_CHECKING:\n    from os import PathLike\n\n"
                       "    from .progress import RenderProgress\n")
    choices = {option["name"]: option["choices"] for option in every}
    names = "".join(f"{name} = {literal(choices[option])}\n" for name, option in NAMED_CHOICES.items())
    classes = [
        typed_dict("EstimatorOptions", "Of estimators of two images, for combine().", types_of(pairs)),
        typed_dict("ImageOptions", "Of the image that functions make of what other programs render.", OF_THE_IMAGE,
                   "EstimatorOptions"),
        typed_dict("RenderOptions", "Of render(), besides its arguments.", of_render),
        typed_dict("RenderArguments", "All that render() takes by name.", own, "RenderOptions")]
    return "\n\n".join([f"{head.replace(' Any,', '')}{names}", *classes])


METRIC = '''

def {name}(image: Any, reference: Any, reference2: Any = None, *, low_dynamic_range: bool = False) -> float:
    """{formula}

    With reference2, a second reference of the same quality:
    {formula_two}
    """
    return compute({registered!r}, image, reference, reference2, low_dynamic_range=low_dynamic_range).value
'''


def metrics_module(metrics):
    head = HEAD.format("Errors of images against references, as `covary compare` measures them. Images are [H, W, 3], "
                       "float32,\nlinear RGB.", "",
                       "from ._metric import MetricResult, compute")
    head = head.replace("TYPE_CHECKING, ", "")
    names = sorted(["MetricResult", "compute", *(identifier(m["name"]) for m in metrics)])
    functions = (METRIC.format(name=identifier(m["name"]), registered=m["name"], formula=m["formula"],
                               formula_two=m["formula_two"]) for m in metrics)
    return head + f"\n__all__ = {names!r}\n" + "".join(functions)


def stub_of(module):
    from nanobind.stubgen import StubGen
    generator = StubGen(module, include_private=True)
    generator.put(module)
    return "# SPDX-License-Identifier: Apache-2.0\n" + generator.get()


def main():
    package = Path(sys.argv[1])
    module = load_extension(package)
    estimators = module.estimators()
    (package / "estimators.py").write_text(estimators_module(estimators))
    (package / "_keywords.py").write_text(
        keywords_module(module.render_options(), estimators,
                        keywords_of_render((package / "_render.py").read_text())))
    (package / "metrics.py").write_text(metrics_module(module.metrics()))
    (package / "_covary.pyi").write_text(stub_of(module))


if __name__ == "__main__":
    main()
