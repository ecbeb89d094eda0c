"""`pip install --no-build-isolation .`: the package for Python with all libraries in its one extension module."""
import os
import pathlib
import re
import subprocess
import sys

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

HERE = pathlib.Path(__file__).resolve().parent
VERSION = re.search(r"VERSION (\S+)", (HERE / "CMakeLists.txt").read_text().split("project(")[1]).group(1)
SHIPPED = ("scenarios", "sweeps")


class ByCMake(build_ext):
    def build_extension(self, extension):
        place = pathlib.Path(self.get_ext_fullpath(extension.name)).resolve()
        build = pathlib.Path(self.build_temp).resolve()
        configure = ["cmake", "-S", HERE, "-B", build, "-DCMAKE_BUILD_TYPE=Release",
                     f"-DPython_EXECUTABLE={sys.executable}", "-DBUILD_SHARED_LIBS=OFF", "-DBUILD_TESTING=OFF",
                     "-DCMAKE_POSITION_INDEPENDENT_CODE=ON", "-DDEPTHSERVO_UNITY=ON", "-DDEPTHSERVO_APPS=OFF",
                     "-DDEPTHSERVO_PAPERS=OFF", "-DDEPTHSERVO_PYTHON=ON"]
        if "CMAKE_GENERATOR" not in os.environ:
            configure += ["-G", "Ninja"]
        subprocess.run(configure, check=True)
        jobs = os.environ.get("CMAKE_BUILD_PARALLEL_LEVEL", str(os.cpu_count()))
        subprocess.run(["cmake", "--build", build, "--target", "depthservo_python", "depthservo_video",
                        "--parallel", jobs], check=True)
        place.parent.mkdir(parents=True, exist_ok=True)
        self.copy_file(str(next((build / "python" / "depthservo").glob("_core*.so"))), str(place))
        self.copy_file(str(build / "src" / "libdepthservo_video.so"), str(place.parent))  # loaded when needed
        for kind in SHIPPED:
            self.copy_tree(str(HERE / "data" / kind), str(place.parent / "data" / kind))


setup(version=VERSION, packages=["depthservo"], package_dir={"": "python"},
      package_data={"depthservo": ["py.typed", "*.pyi"]}, ext_modules=[Extension("depthservo._core", [])],
      cmdclass={"build_ext": ByCMake}, zip_safe=False)
