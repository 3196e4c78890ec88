# SPDX-License-Identifier: Apache-2.0
"""Lines of the documentation that other parts of the tests run: how the line begins, the file that runs it, and what
stands there."""
ELSEWHERE = (
    ("make demo", ".github/workflows/test.yml", "make demo"),
    ("make test", ".ci/run", "make test"),
    ("make setup", "Makefile", "test: "),
    ("make wheel", ".github/workflows/test.yml", "make deb wheel blender docs"),
    ("make install", "tests/install/install_test", "--install"),
    ("git clone <this repository>", ".github/workflows/test.yml", "actions/checkout"),
    ("cmake --preset dev", ".ci/run", "make test"),
    ("cmake --build --preset dev", ".ci/run", "make test"),
    ("ctest --preset dev -LE nightly", ".ci/run", "make test"),
    ("python3 -m venv covary-env", "tests/python/wheel_test.py", "venv"),
    (". covary-env/bin/activate", "tests/python/wheel_test.py", "venv"),
    ("pip install", "tests/python/wheel_test.py", "pip"),
    ("python docs/examples/denoise_mitsuba.py", "tests/examples/denoise_test.py",
     "docs/examples/denoise_{RENDERER}.py"),
    ("python docs/examples/denoise_luxcore.py", "tests/examples/denoise_test.py",
     "docs/examples/denoise_{RENDERER}.py"),
    ("blender -b scene.blend -P docs/examples/denoise_blender.py", "tests/examples/denoise_test.py",
     "docs/examples/denoise_{RENDERER}.py"),
    ("blender -b scene.blend --python-expr", "tests/blender/in_blender.py", "bpy.ops.render.covary("),
    ("python docs/examples/mitsuba_crn.py", "tests/examples/mitsuba_test.py", "mitsuba_crn"),
    ("docs/examples/render_on_slurm.sh", "tests/examples/slurm_test.py", "_on_slurm.sh"),
    ("SBATCH_TIMELIMIT=2:00:00 docs/examples/render_on_slurm.sh", "tests/examples/slurm_test.py", "_on_slurm.sh"),
    ("docs/examples/frames_on_slurm.sh", "tests/examples/slurm_test.py", "_on_slurm.sh"),
    ("c++ -std=c++20", "tests/package/package_test.py", "pkg-config"),
    ("export PKG_CONFIG_PATH", "tests/package/package_test.py", "PKG_CONFIG_PATH"),
    ("./render_scene", "tests/package/package_test.py", "render_scene"),
    ("covary combine --crn mitsuba/crn_*.exr", "tests/examples/mitsuba_test.py", "combine"),
)
#: Blocks of these pages that hold a text, likewise.
BLOCKS_ELSEWHERE = (
    ("docs/library.md", "#include <covary/", "tests/package/package_test.py", "library.md"),
    ("docs/library.md", "find_package(covary", "tests/package/package_test.py", "library.md"),
    ("docs/mitsuba.md", "import covary.mitsuba", "tests/python/pages_test.py", "mitsuba.md"),
    ("docs/cluster.md", "LocalCluster(", "tests/python/pages_test.py", "cluster.md"),
    ("docs/cluster.md", "covary.distributed.frames(", "tests/python/distributed_test.py", "distributed.frames("),
    ("docs/blender.md", "covary.blender.render(", "tests/python/blender_test.py", "blender.render("),
    ("docs/other-renderers.md", "class Common(", "tests/examples/mitsuba_test.py", "mitsuba_crn.py"),
)
