"""The state of uncontrolled vehicles and the ego goes in; out comes where they drive next.

Door: `registry`, where a traffic is one line; `model`, which says what a traffic is; `set_sampling`, `replay`,
`reactive_replay` and `motion`.
"""
