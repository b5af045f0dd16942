// A part of what is seen as a video, by the browser's own encoder.

const FRAMES_S = 30;

export class Clip {
  private readonly canvas = document.createElement("canvas");
  private readonly parts: Blob[] = [];
  private readonly recorder: MediaRecorder;

  // Begins with the picture that `paint` draws into a canvas; `done` gets the WebM when it was ended.
  constructor(
    private readonly paint: (canvas: HTMLCanvasElement) => void,
    done: (video: Blob) => void,
  ) {
    this.draw();
    this.recorder = new MediaRecorder(this.canvas.captureStream(FRAMES_S), {
      mimeType: "video/webm",
      videoBitsPerSecond: 8e6,
    });
    this.recorder.ondataavailable = ({ data }) => this.parts.push(data);
    this.recorder.onstop = () => done(new Blob(this.parts, { type: "video/webm" }));
    this.recorder.start();
  }

  // Takes what is shown now.
  draw(): void {
    this.paint(this.canvas);
  }

  end(): void {
    this.draw();
    this.recorder.stop();
  }
}
