// The frames that there are, and the instant that is shown.

/** The most bytes of frames that are kept of a run that goes on. */
const MOST_BYTES = 400e6;

/** The bytes of a frame without particles: that of a solid that moves has none. */
const LEAST_BYTES = 1000;

const bytesOf = (frame) => LEAST_BYTES + frame.count * (6 + frame.levels.length);

const NO_POSE = [1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0];

/** The mesh of the solids between two frames and where its parts are then; those of the nearer one if it is another mesh. */
function solidsBetween({ from, to, part }) {
  if (from.mesh !== to.mesh || !(part > 0)) return part < 0.5 ? from : to;
  const poses = Array.from({ length: Math.max(from.poses?.length ?? 0, to.poses?.length ?? 0) }, (_, k) =>
    poseBetween(from.poses?.[k] ?? NO_POSE, to.poses?.[k] ?? NO_POSE, part));
  return { mesh: from.mesh, poses };
}

/** The speeds of playback: simulated seconds per second. */
const SPEEDS = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100];

class Timeline {
  constructor() {
    this.frames = [];
    /** The place between frames: 2.5 is in the middle between the third and the fourth. */
    this.place = 0;
    this.playing = false;
    this.speed = 1;
    this.bytes = 0;
  }

  get last() {
    return Math.max(this.frames.length - 1, 0);
  }

  /** The two frames between which the shown instant lies, and where between them. */
  shown(blends) {
    if (this.frames.length === 0) return null;
    const k = clamp(Math.floor(this.place + 1e-9), 0, this.last);
    const part = blends ? clamp(this.place - k, 0, 1) : 0;
    return { from: this.frames[k], to: this.frames[Math.min(k + 1, this.last)], part };
  }

  get time() {
    const shown = this.shown(true);
    return shown ? shown.from.time + (shown.to.time - shown.from.time) * shown.part : 0;
  }

  get duration() {
    return this.frames.length ? this.frames[this.last].time - this.frames[0].time : 0;
  }

  /** The shown time in words, with the digits that tell two frames apart, and `least` at least. */
  timeText(least) {
    const every = this.duration / Math.max(this.last, 1);
    const digits = every > 0 ? 1 - Math.floor(Math.log10(every)) : least;
    return this.time.toFixed(clamp(digits, least, 9));
  }

  add(frame) {
    this.frames.push(frame);
    this.bytes += bytesOf(frame);
  }

  /** Leaves out every other frame but the last where they take too much room. */
  thin() {
    if (this.bytes < MOST_BYTES) return;
    const following = this.place >= this.last;
    const time = this.time;
    this.frames = this.frames.filter((_, k) => k % 2 === 0 || k === this.frames.length - 1);
    this.bytes = this.frames.reduce((sum, frame) => sum + bytesOf(frame), 0);
    if (following) this.place = this.last;
    else this.seek(time);
  }

  clear() {
    [this.frames, this.place, this.bytes] = [[], 0, 0];
  }

  /** Goes to a time. */
  seek(time) {
    const after = this.frames.findIndex((frame) => frame.time > time);
    if (after <= 0) {
      this.place = after === 0 ? 0 : this.last;
      return;
    }
    const [a, b] = [this.frames[after - 1].time, this.frames[after].time];
    this.place = after - 1 + (time - a) / (b - a);
  }

  /** Goes on by so many seconds of the clock; starts again behind the end. */
  pass(seconds) {
    if (!this.playing || this.frames.length < 2) return false;
    const time = this.time + seconds * this.speed;
    if (this.place >= this.last) this.place = 0;
    else this.seek(time);
    return true;
  }

  step(by) {
    this.place = clamp(by > 0 ? Math.floor(this.place + 1e-9) + by : Math.ceil(this.place - 1e-9) + by, 0, this.last);
  }

  /** The speed at which all frames take about ten seconds; the speed of the clock if that takes 3 to 30. */
  natural() {
    const duration = this.duration;
    if (!(duration > 0) || (duration >= 3 && duration <= 30)) return 1;
    return SPEEDS.reduce((best, speed) => (Math.abs(Math.log(duration / speed / 10)) < Math.abs(Math.log(duration / best / 10)) ? speed : best));
  }
}
