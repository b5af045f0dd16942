// A Worker for pages that are opened from a disk, where browsers refuse one: a hidden frame whose
// script has the same messages. The site's search runs in it; served pages keep the browser's own.

function importScripts(...urls) {
  const load = (url) =>
    new Promise((resolve, reject) => {
      const script = document.createElement("script");
      Object.assign(script, { src: url, onload: resolve, onerror: reject });
      document.body.append(script);
    });
  return urls.reduce((before, url) => before.then(() => load(url)), Promise.resolve());
}

class FrameWorker extends EventTarget {
  constructor(url) {
    super();
    this.frame = document.createElement("iframe");
    this.frame.hidden = true;
    document.body.append(this.frame);
    this.inside = this.frame.contentWindow;
    this.heed = (event) => {
      if (event.source !== this.inside) return;
      event.stopImmediatePropagation();
      this.dispatchEvent(new MessageEvent("message", { data: event.data }));
    };
    window.addEventListener("message", this.heed);
    const page = this.inside.document;
    page.open();
    page.write(`<html><body><script>
      postMessage = (data) => parent.dispatchEvent(
        new MessageEvent("message", { data, source: window }));
      ${importScripts}
    </script><script src="${url}"></script></body></html>`);
    page.close();
    // Behind open(), which takes a window's listeners away.
    this.loaded = new Promise((resolve) => (this.inside.onload = resolve));
  }

  set onmessage(heed) {
    this.addEventListener("message", heed);
  }

  postMessage(data) {
    const send = () => this.inside.dispatchEvent(new MessageEvent("message", { data }));
    this.loaded.then(send);
  }

  terminate() {
    window.removeEventListener("message", this.heed);
    this.frame.remove();
  }
}

if (location.protocol === "file:") window.Worker = FrameWorker;
