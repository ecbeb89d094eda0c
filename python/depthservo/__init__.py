"""Image-based visual servoing with observed depth.

Conventions, as in C++: camera frame x right, y down, z forward; SI units; a twist is (vx, vy, vz) [m/s],
(wx, wy, wz) [rad/s] of the camera in its own frame; x, y are normalised image coordinates (pixel minus principal
point, over focal length); chi = 1/Z. Arrays of float64 in C order are used without copies.

Bad input raises InputError, or another ValueError, whose text says what was expected.

    import depthservo as ds
    camera = ds.Camera(640, 480, 600, 600, 319.5, 239.5)
    depths = ds.DepthFilter(4, focal=camera.focal)
    for t, uv, twist in images:                      # uv: (4, 2) pixels, NaN where hidden
        depths.step(t, camera.normalise(uv), twist)  # twist: (6,), since the last image
        print(depths.z, depths.sigma_z, depths.status)
"""

import enum

from ._core import (
    STATUS_NAMES, Camera, ConstantDepth, DepthEstimate, DepthEstimator, DepthFilter, ErrorProfile, Estimates,
    GaussMarkov, InputError, InverseDepthFilter, Motion, MotionBuffer, NonlinearDepthObserver, OdometryNoise,
    Run, Sequence, TwoFrameLeastSquares, WindowDepthEstimator, __version__, cramer_rao_bound,
    describe_recording, flow, interaction_matrix)
from .runs import (
    RunFolder, SweepResults, compare, read_run, read_sweep, record, replay, run, shipped_scenarios, sweep)


class Status(enum.IntEnum):
    """What an estimate is worth; where several hold: lost, coasting, rejected, unexcited, converging, valid."""

    UNSET = 0  #: never measured
    CONVERGING = 1  #: being learnt; sigma_z is not below 10 % of z yet
    VALID = 2  #: sigma_z below 10 % of z
    UNEXCITED = 3  #: the camera's motion tells nothing of this depth; z and sigma_z are kept
    COASTING = 4  #: hidden; predicted from the camera's motion
    REJECTED = 5  #: the last measurement contradicted the prediction and was not used
    LOST = 6  #: behind the camera, or predicted too vaguely to be of use


def JointDepthFilter(n, **options):
    """DepthFilter whose points share the odometry's error (`estimator="joint"`); see `shared()`."""
    return DepthFilter(n, estimator="joint", **options)


def read_sequence(path, **options):
    """A recorded sequence: a folder (ours, TUM, ICL-NUIM, EuRoC) or a ROS 1 or 2 bag; options as of Sequence."""
    return Sequence(str(path), **options)


def read_bag(path, topics=(), **options):
    """A ROS 1 or 2 bag. topics: "image=/camera/image_raw", "odometry=/odom"; default: the only one of each kind."""
    return Sequence(str(path), topics=list(topics), **options)


__all__ = [
    "STATUS_NAMES", "Camera", "ConstantDepth", "DepthEstimate", "DepthEstimator", "DepthFilter", "ErrorProfile",
    "Estimates", "GaussMarkov", "InputError", "InverseDepthFilter", "JointDepthFilter", "Motion", "MotionBuffer",
    "NonlinearDepthObserver", "OdometryNoise", "Run", "RunFolder", "Sequence", "Status", "SweepResults",
    "TwoFrameLeastSquares", "WindowDepthEstimator", "__version__", "compare", "cramer_rao_bound",
    "describe_recording", "flow", "interaction_matrix", "read_bag", "read_run", "read_sequence", "read_sweep",
    "record", "replay", "run", "shipped_scenarios", "sweep"]
