# Copyright 2026 The valve_friction_ros developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0 Unless required by applicable law or agreed to in
# writing, software distributed under the License is distributed on an "AS IS" BASIS, WITHOUT
# WARRANTIES OR CONDITIONS OF ANY KIND, either express or implied. See the License for the specific
# language governing permissions and limitations under the License.

"""The dashboard, managed by its life cycle: it hears and shows while it is active."""

import urllib.error
import urllib.request

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from local_server import free_port


def test_pages_rest_with_the_node(live):
    port = free_port()
    live.start("dashboard", {"port": port, "lifecycle": True}, namespace=None)
    client = live.client

    def change(transition):
        request = ChangeState.Request(transition=Transition(id=transition))
        assert client.call(ChangeState, "/dashboard/change_state", request).success

    def page():
        try:
            with urllib.request.urlopen(f"http://127.0.0.1:{port}/", timeout=5) as answer:
                return answer.status
        except urllib.error.HTTPError as error:
            return error.code
        except OSError:
            return None

    client.wait_until(lambda: page() == 503, "a page of a dashboard at rest")
    for _ in range(2):
        change(Transition.TRANSITION_CONFIGURE)
        assert page() == 503
        change(Transition.TRANSITION_ACTIVATE)
        assert page() == 200
        change(Transition.TRANSITION_DEACTIVATE)
        assert page() == 503
        change(Transition.TRANSITION_CLEANUP)
