/* The scenes with which the pages begin: a fingertip, and on the pad a texture whose shape is seen and felt at once. */

export const START_SCENE = { finger: { kind: "fingertip" } };

/** Of the pad. Wales of 3.2 mm are seen at five times their size, and their contact is solved in a second. */
export const PAD_SCENE = { ...START_SCENE, texture: { kind: "corduroy-8-wale" } };
