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

# What Ubuntu has not: --build-arg EXTRAS="nicegui>=3.18,<4" for the dashboard, for bags what doc/start/ros.md names.
ARG EXTRAS=""
RUN if [ -n "$EXTRAS" ]; then \
        apt-get update && apt-get install -y --no-install-recommends python3-venv \
        && python3 -m venv --system-site-packages /opt/extras && /opt/extras/bin/pip install --no-cache-dir $EXTRAS \
        && rm -rf /var/lib/apt/lists/*; \
    fi
ENV PYTHONPATH=/opt/extras/lib/python3.12/site-packages

# The nodes need no other right than to write their history; the kernels are compiled into the image.
RUN useradd --create-home valve && install -d -o valve /home/valve/.ros
USER valve
ENV ROS_HOME=/home/valve/.ros NUMBA_CACHE_DIR=/home/valve/.numba
RUN ["/bin/bash", "-c", ". /ws/install/setup.bash && python3 -c 'from valve_friction_ros.identification.preparation import compile_methods; compile_methods()'"]
VOLUME /home/valve/.ros
ENTRYPOINT ["/bin/bash", "-c", ". /ws/install/setup.bash && exec \"$@\"", "--"]
CMD ["ros2", "launch", "valve_friction_ros", "monitor.launch.py"]
