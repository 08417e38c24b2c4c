// The loop between two marks, A and B: each can be set, and set again where it is to end the loop.

export class Section {
  constructor() {
    this.marks = [null, null];
  }

  // Set mark 0 or 1 at a frame; returns [first, last], or null where the loop ends.
  mark(which, frame, lastFrame) {
    const isThere = this.marks[which] === frame;
    this.marks[which] = frame;
    const [first, last] = [this.marks[0] ?? 0, this.marks[1] ?? lastFrame];
    if (!isThere && first < last) return [first, last];
    this.marks = [null, null];
    return null;
  }
}
