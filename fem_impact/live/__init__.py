"""Playing: a body that answers strokes at once, from the keyboard, a MIDI file or a live MIDI port.

Start in `player`: strokes and the body that answers them. `controllers` turns keys and notes into strokes, `devices`
plays what comes of them, or writes it.
"""
