/* The scene with which the pages begin: a fingertip on the texture that is the default. */

export const START_SCENE = { finger: { kind: "fingertip" } };
