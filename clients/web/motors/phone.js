/* The motor of a phone, which can only be switched on and off.

Model: each period it runs for a part of the period that is the strength. A pattern is one pulse, no longer than the
period, so the phone is still soon after the page stops asking.
Limits: unverified on devices. Browsers refuse before the first tap. */

const LEAST = 10; // ms; motors of phones do not start in less (unverified default)

export const phone = {
  name: "phone",
  form: "pulses",
  hand: "",

  /** Runs for a part of `period` (ms), the strength, 0 to 1; 0 stops. */
  play(strength, period) {
    const tapped = navigator.userActivation?.hasBeenActive ?? true; // before that, browsers log an error
    if (!tapped) return;
    navigator.vibrate(strength > 0 ? Math.max(LEAST, Math.round(strength * period)) : 0);
  },
};
