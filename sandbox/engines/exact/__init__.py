"""exact: event-driven, hand-written. Closed-form motion between events, roots for the next event."""
