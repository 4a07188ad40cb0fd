// A page opened from disk may start no worker: the same script runs in a frame without a face.
window.Worker = class extends EventTarget {
  constructor(url) {
    super()
    const frame = document.createElement("iframe")
    frame.hidden = true
    document.body.append(frame)
    const inside = frame.contentWindow
    inside.postMessage = data => this.dispatchEvent(new MessageEvent("message", { data }))
    this.ready = new Promise(done => {
      const script = frame.contentDocument.createElement("script")
      script.src = new URL(url, location)
      script.onload = () => done(inside)
      frame.contentDocument.body.append(script)
    })
  }
  postMessage(data) {
    this.ready.then(inside => inside.dispatchEvent(new MessageEvent("message", { data })))
  }
}
