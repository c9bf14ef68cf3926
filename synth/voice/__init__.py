"""Running plans: blocks of sound, live changes, a hand, the limiter, and recordings of live sessions."""
