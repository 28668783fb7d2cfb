"""A process that writes to a history until it is killed, and says what it has finished."""

import sys
from itertools import count
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

if __name__ == "__main__":
    from histories import START, VALVE, refused, success

    from valve_friction_ros.health import Baseline
    from valve_friction_ros.history import HistoryFile, KeptBaseline

    history, number = HistoryFile(Path(sys.argv[1])), int(sys.argv[2])
    for k in count() if len(sys.argv) < 4 else range(int(sys.argv[3])):
        valve = VALVE._replace(name=f"/fv_{number}/identifier")
        if k % 5 == 4:
            history.add(refused(START + k, valve=valve))
        else:
            history.add(success(START + k, 100.0 + k, valve=valve))
        history.set_baseline(valve, KeptBaseline(Baseline(100.0 + k), START + k, START + k))
        sys.stdout.write(f"{k}\n")
        sys.stdout.flush()
