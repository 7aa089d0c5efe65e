"""Messages of a robot's log: standard JointState, and PAL's introspection of named values (pal_statistics_msgs)."""

from typing import TYPE_CHECKING, Any

from calibration.errors import InputError

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

MOTOR, ABSOLUTE, COMMAND = "/joint_states", "/joint_states_absolute", "/joint_states_command"
NAMES, VALUES = "/introspection_data/names", "/introspection_data/values"
WRIST = "/wrist_ft"
JOINT_STATE, WRENCH = "sensor_msgs/msg/JointState", "geometry_msgs/msg/WrenchStamped"
POSES = (
    "geometry_msgs/msg/PoseStamped",
    "geometry_msgs/msg/PoseWithCovarianceStamped",
    "geometry_msgs/msg/TransformStamped",
    "nav_msgs/msg/Odometry",
)
STATISTICS_NAMES, STATISTICS_VALUES = (
    "pal_statistics_msgs/msg/StatisticsNames",
    "pal_statistics_msgs/msg/StatisticsValues",
)
PREFIX = "- "
"""What PAL's introspection puts before every name."""

SUFFIXES = {
    "q_motor": "_position",
    "q_link": "_absolute_encoder_position",
    "v_motor": "_velocity",
    "effort": "_effort",
    "q_command": "_command",
}
_DEFINITIONS = {
    STATISTICS_NAMES: "std_msgs/Header header\nstring[] names\nuint32 names_version\n",
    STATISTICS_VALUES: "std_msgs/Header header\nfloat64[] values\nuint32 names_version\n",
}


def typestore(ros: int) -> "Typestore":
    """Message types of ROS 1 or 2, PAL's among them.

    Raises:
        InputError: rosbags is not installed.
    """
    try:
        from rosbags.typesys import Stores, get_types_from_msg, get_typestore
    except ImportError as error:
        raise InputError("bag", "the package rosbags is not installed; install the extra `ros`") from error
    store = get_typestore(Stores.ROS1_NOETIC if ros == 1 else Stores.ROS2_HUMBLE)
    types: dict[str, Any] = {}
    for name, text in _DEFINITIONS.items():
        types |= get_types_from_msg(text, name)
    store.register(types)
    return store
