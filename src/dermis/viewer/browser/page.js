// What rendercanvas' page lacks: it connects again by itself, and two fingers zoom and pan.

const RETRY_MS = 1000

// The socket opened last, which may still be on its way: two at once would leave this page watching itself.
let latest = null
window.WebSocket = class extends window.WebSocket {
  constructor (...given) {
    super(...given)
    latest = this
  }
}

setInterval(() => {
  if (latest && latest.readyState === WebSocket.CLOSED) { window.openWebsocketConnection() }
}, RETRY_MS)

const fingers = new Map()
let pinching = false

function send (type, x, y) {
  const touches = {}
  let index = 0
  for (const finger of fingers.values()) { touches[index++] = finger }
  const event = {
    type, x, y, button: 1, buttons: [1], modifiers: [],
    ntouches: index, touches, timestamp: performance.now() / 1000
  }
  if (window.websocket && window.websocket.readyState === WebSocket.OPEN) {
    window.websocket.send(JSON.stringify(event))
  }
}

function follow (event) {
  if (event.pointerType !== 'touch') { return }
  if (event.type === 'pointerdown' || fingers.has(event.pointerId)) {
    fingers.set(event.pointerId, { x: event.clientX, y: event.clientY, pressure: event.pressure })
  }
  if (fingers.size < 2 && !pinching) { return }
  pinching = true
  event.stopImmediatePropagation() // one finger alone is rendercanvas' own
  event.preventDefault()
  const first = fingers.values().next().value
  send('pointer_move', first.x, first.y)
}

function leave (event) {
  fingers.delete(event.pointerId)
  if (fingers.size === 0) { pinching = false }
}

for (const type of ['pointerdown', 'pointermove']) { window.addEventListener(type, follow, { capture: true }) }
for (const type of ['pointerup', 'pointercancel']) { window.addEventListener(type, leave, { capture: true }) }
