/* The colours of materials, by the names of the catalogue. Chosen by eye; a height has no colour of its own. */

const MATERIALS = [
  // words in names, colour of crests, colour of valleys
  ["denim", "#7d9ac6", "#22355a"],
  ["corduroy", "#d8b98c", "#3a2a1b"],
  ["burlap", "#c9a878", "#3f2d18"],
  ["linen cheesecloth", "#e2d8c0", "#5c523f"],
  ["sateen percale muslin drill", "#dfe3ea", "#525c70"],
  ["sandpaper", "#b5794a", "#33201a"],
  ["maple", "#e0bd8d", "#5d3c1e"],
  ["oak sawn", "#c99c66", "#46290f"],
  ["leather", "#a4663d", "#2c170d"],
  ["steel knob coin screw", "#cdd3da", "#2d333b"],
  ["glass", "#cfe3e6", "#33535b"],
  ["tile", "#cf8f6b", "#4f2a1b"],
  ["plaster concrete", "#cbc8c0", "#46443f"],
  ["corrugated", "#cda678", "#54391c"],
  ["paper banknote bristol", "#ece7da", "#6b6455"],
  ["rubber vinyl", "#8b8f96", "#17191d"],
  ["golf", "#f2f1ec", "#6d6c68"],
  ["basketball", "#d07a3c", "#3f1c0a"],
  ["silicone", "#e6b49a", "#5f3526"],
  ["plastic bottle lenticular layers", "#c4cbd6", "#343c4a"],
];

/** Gives `element` the colours of the texture `name`; those of the page where no material is known. */
export function colour(element, name) {
  const [, crest = "", valley = ""] =
    MATERIALS.find(([words]) => words.split(" ").some((word) => name.includes(word))) ?? [];
  element.style.setProperty("--relief-crest", crest);
  element.style.setProperty("--relief-valley", valley);
}
