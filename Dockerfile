# The monitor on ROS 2 Jazzy: docker build -t valve_friction_ros . && docker run --rm valve_friction_ros
FROM ros:jazzy
WORKDIR /ws
COPY . src/valve_friction_ros
RUN apt-get update \
    && rosdep update --rosdistro jazzy \
    && rosdep install --from-paths src --ignore-src --rosdistro jazzy --dependency-types exec -y \
    && . /opt/ros/jazzy/setup.sh \
    && colcon build --merge-install \
    && rm -rf /var/lib/apt/lists/*

# The node needs no other right than to write its history.
RUN useradd --create-home valve
USER valve
ENV ROS_HOME=/home/valve/.ros
VOLUME /home/valve/.ros
ENTRYPOINT ["/bin/bash", "-c", ". /ws/install/setup.bash && exec \"$@\"", "--"]
CMD ["ros2", "launch", "valve_friction_ros", "monitor.launch.py"]
