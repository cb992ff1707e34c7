"""What the rows and columns of the arrays mean that the kernels share."""

# rows of where every contact stands (6, n_contacts)
APPROACH, COMPRESSION, FORCE, ENERGY, RATE, REMEMBERED = range(6)

# rows of where every contact would end if nothing pushed in the step (3, n_contacts), see `schemes.Free`
FREE_END, FREE_MEAN, FREE_RATE = range(3)

# rows of a run's contacts: where they stand, where they would end, and seven more, see `bundles.Contacts`; their work
CONTACT_ROWS = 17

# rows of what unit forces take from that (6, n_contacts, n_contacts), see `schemes.Own`
OWN_END, OWN_END_RAMP, OWN_MEAN, OWN_MEAN_RAMP, OWN_RATE, OWN_RATE_RAMP = range(6)

# rows of a step of every mode (N_LANE, n_modes), see `propagation.lane_table`
A11, A12, A21, A22, M1, M2, M3, N_LANE = range(8)

# columns of a recorded step (n_steps, HEAD + (WIDTH + 1) n_contacts), and from the first of a contact's on, of which
# there are WIDTH and, behind those of all, what each remembers; see `record`
START, LENGTH, BLIND, HEAD = range(4)
SPEED, CLOSED, PUSH, GAIN, WIDTH = range(1, 6)

# where a crossing lies: two lengths about it, the size of the values there, and length, value and slope of a try
LOW, HIGH, SIZE, TRIED, MISSED, SLOPE = range(6)

# columns of the bounds of a flight (n_contacts, 6), see `flight.motion_bounds`
RIGID, RIGID_RATE, RIGID_ACCELERATION, REACH, FASTEST, HARDEST = range(6)

# of a run (`bundles.Course`): times [s] now, until when events are passed, how long the next such time will be, since
# when events are counted, and when the present flight began; energy [J] at which the bodies are at rest; approach [m]
# at which bodies that nearly touched in flight turned back, the nearest of all
TIME, PAUSE, RESPITE, RESET, TAKEOFF, FAINT, MISS, CLOCKS = range(8)

# and counters: steps, of them in contact, fallen back to scheme A, and blind; releases; events since RESET; halvings of
# the step, and those that it needs; level whose table has predicted the next step, or -1; whether what the contacts
# remember is still to be brought up to the state; steps before the present flight, or -1; whether the run has begun
STEPS, LOOKS, FALLBACKS, BLINDS, RELEASED, EVENTS, LEVEL, LEAST, READY, FRESH, FLYING, BEGUN = range(12)

# and of the search for a step's end: what is sought, the contact that opens or closes, or that has a corner of its
# force, which corner, and how many tries there were
SEEKS, TARGET, CORNERED, WHICH, TRIES, COUNTERS = range(12, 18)

# of one blow among many (`bundles.Track`): where its contact stands as above, APPROACH to RATE; what the forces before
# the last one do to the next step; when the contact began, and the time in contact before [s]; the force's impulse,
# its moment about the start, its largest, its jumps [N] and bends [N/s], and where it last ended;
# approaches [m]: deepest of all, farthest of this contact and of the last gap, and what a touch or gap must exceed;
# sum of 1 / rate where contacts begin and end; steps needed; how near to zero the approach turned back
END_AHEAD, MEAN_AHEAD, RATE_AHEAD, BEGAN, TOUCHED, IMPULSE, MOMENT, PEAK, JUMPS, BENDS, HELD, SLOPED = range(5, 17)
DEEPEST, HIGHEST, LOWEST, MARGIN, SWING, NEEDED, NEAREST, BLOW_STATES = range(17, 25)

# and counters: whether it is in contact; how it would end now; contacts that have ended; runs of steps with a force;
# steps of the kernel that are combined; to which step the modes are carried; whether what looks ahead miss in this
# flight is found by that
PRESSED, ENDING, N_CONTACTS, N_SEGMENTS, KNOWN, CARRIED, SHARP, BLOW_COUNTS = range(8)

# rows of what is found of many blows (N_FOUND, n_cells): impacts, time in contact, impulse, peak force, centroid, how
# it ended, the relative error of the peak by `misfit` (of certified runs), steps needed, the relative change of the
# time in contact per relative change of the approach, and how near to zero that turned back over how deep it was
FOUND_IMPACTS, FOUND_TIME, FOUND_IMPULSE, FOUND_PEAK, FOUND_CENTROID, FOUND_STATUS = range(6)
FOUND_MISFIT, FOUND_STEPS, FOUND_SWING, FOUND_MARGIN, N_FOUND = range(6, 11)
