"""Charts of the pages, as options of ECharts: numbers and fixed words, never text from outside."""

from valve_friction_ros.dashboard.charts.signal_charts import (
    live_chart,
    live_data,
    loop_chart,
    loop_data,
)
from valve_friction_ros.dashboard.charts.trend_chart import trend_chart

__all__ = ["live_chart", "live_data", "loop_chart", "loop_data", "trend_chart"]
