"""The state of uncontrolled vehicles and the ego goes in; out comes where they drive next.

Door: `kinds`, where a traffic is one line; `registry`, which makes it; `model`, which says what a traffic is;
`set_sampling`, `replay`, `reactive_replay` and `motion`.
"""
