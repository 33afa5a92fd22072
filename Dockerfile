# The bridge on Ubuntu 24.04 with ROS 2 Jazzy, or with --build-arg ROS=kilted, for amd64 and arm64;
# doc/ros.md has its use.
ARG ROS=jazzy
FROM ros:${ROS}-ros-core AS build
SHELL ["/bin/bash", "-c"]
# pymavlink has a pip key only, and rosdep asks for the variable on Ubuntu 24.04 (PEP 668).
ENV PIP_BREAK_SYSTEM_PACKAGES=1
RUN apt-get update && apt-get install -y --no-install-recommends \
      python3-colcon-common-extensions python3-pip python3-rosdep && \
    rosdep init && rosdep update --rosdistro "$ROS_DISTRO"
WORKDIR /ws
COPY . src/illuminator_ros
RUN rosdep install --from-paths src --ignore-src -y --dependency-types=exec && \
    source "/opt/ros/$ROS_DISTRO/setup.bash" && colcon build --packages-select illuminator_ros

# docker build --target test .
FROM build AS test
RUN rosdep install --from-paths src --ignore-src -y && source install/setup.bash && \
    colcon test --packages-select illuminator_ros --event-handlers console_direct+ && \
    colcon test-result --verbose

FROM build
# dialout may open serial ports.
RUN useradd --create-home --groups dialout pilot && rm -rf /var/lib/apt/lists/*
USER pilot
# The bridge itself is the first process, since "docker stop" sends SIGTERM to that one only.
ENTRYPOINT ["/bin/bash", "-c", "source /ws/install/setup.bash && \
    exec /ws/install/illuminator_ros/lib/illuminator_ros/\"$0\" \"$@\""]
CMD ["bridge"]
