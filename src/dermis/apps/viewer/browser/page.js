// Additions to the page of rendercanvas: it reconnects, works behind https, sends pinch gestures, and reports its
// size when it becomes active.

import { take } from './files.js'
import { follow } from './stage.js'

const RETRY_MS = 1000
const TAPS_MS = 350
const TAPS_PX = 24
const WATCHING = 'watching: another page has control'
const LOST = 'connection lost, reconnecting …'
const OUR_KEYS = ['Tab', 'F1']
const OUR_KEYS_WITH_CONTROL = ['z', 'y', 's']

// Moves are sent immediately, because a delayed one would arrive after the release; the server merges queued moves.
window.BaseRenderView.prototype.setThrottle = function (throttle) {
  this._moveThrottle = 0
  this._wheelThrottle = throttle
}

// The token is in a cookie now; in the URL it would remain in the history and be visible on screenshots.
if (window.location.search) { window.history.replaceState(null, '', window.location.pathname) }

const notice = document.getElementById('notice')

// Set as a style property, otherwise rendercanvas would choose a size; the policy forbids style attributes.
Object.assign(document.getElementById('canvas').style, { width: '100%', height: '100%' })

// The last opened socket, perhaps still connecting: with two sockets this page would only watch itself.
let latest = null
window.WebSocket = class extends window.WebSocket {
  constructor (address, ...rest) {
    super(safe(address), ...rest)
    latest = this
    this.addEventListener('message', hear)
    this.addEventListener('close', () => { notice.textContent = LOST })
  }
}

// A page served over https, through a proxy, may only open encrypted sockets.
function safe (address) {
  return window.location.protocol === 'https:' ? address.replace(/^ws:/, 'wss:') : address
}

setInterval(() => {
  if (latest && latest.readyState === WebSocket.CLOSED) { window.openWebsocketConnection() }
}, RETRY_MS)

function hear (event) {
  const message = typeof event.data === 'string' ? JSON.parse(event.data) : { bytes: event.data }
  take(message)
  follow(message)
  if (message.type !== 'active') { return }
  notice.textContent = message.value ? '' : WATCHING
  if (message.value) {
    sendSize()
    takeKeys()
  }
}

// The server ignores the size of a page without control, and a restarted server does not know it.
function sendSize () {
  const sizeObserver = new ResizeObserver(([entry], observer) => {
    observer.disconnect()
    const ratio = window.devicePixelRatio
    const box = entry.devicePixelContentBoxSize // which Safari lacks
    const { width, height } = entry.contentRect
    const pwidth = box ? box[0].inlineSize : Math.floor(width * ratio)
    const pheight = box ? box[0].blockSize : Math.floor(height * ratio)
    sendEvent({ type: 'resize', width: pwidth / ratio, height: pheight / ratio, pwidth, pheight, ratio })
  })
  sizeObserver.observe(document.querySelector('#canvas img'))
}

// Make keys and the wheel work without a first click, except on touch screens, where it would open the keyboard.
function takeKeys () {
  const field = document.querySelector('#rendercanvas-focus-element-container input')
  if (field && window.matchMedia('(hover: hover)').matches) { field.focus({ preventScroll: true }) }
}

function sendEvent (event) {
  if (window.websocket && window.websocket.readyState === WebSocket.OPEN) {
    window.websocket.send(JSON.stringify({ timestamp: performance.now() / 1000, ...event }))
  }
}

// Otherwise Tab would leave the picture and Ctrl+S would save the page.
window.addEventListener('keydown', (event) => {
  const held = event.ctrlKey || event.metaKey
  const keys = held ? OUR_KEYS_WITH_CONTROL : OUR_KEYS
  if (keys.includes(held ? event.key.toLowerCase() : event.key)) { event.preventDefault() }
}, { capture: true })

const fingers = new Map()
let pinching = false
let began = null // position where the last finger touched
let tapped = null // position and time of the last tap

function count (event) {
  if (event.pointerType !== 'touch') { return }
  if (event.type === 'pointerdown') { began = { x: event.clientX, y: event.clientY } }
  if (event.type === 'pointerdown' || fingers.has(event.pointerId)) {
    fingers.set(event.pointerId, { x: event.clientX, y: event.clientY, pressure: event.pressure })
  }
  if (fingers.size < 2 && !pinching) { return }
  pinching = true
  event.stopImmediatePropagation() // rendercanvas handles a single finger
  event.preventDefault()
  sendFingers()
}

function sendFingers () {
  const touches = Object.fromEntries([...fingers.values()].entries())
  const { x, y } = touches[0]
  sendEvent({ type: 'pointer_move', x, y, button: 1, buttons: [1], modifiers: [], ntouches: fingers.size, touches })
}

// Turn two taps at one point into a double click, because browsers do not do so here.
function tap ({ clientX: x, clientY: y }) {
  const at = performance.now()
  if (Math.hypot(x - began.x, y - began.y) > TAPS_PX) { // a drag, not a tap
    tapped = null
  } else if (tapped && at - tapped.at < TAPS_MS && Math.hypot(x - tapped.x, y - tapped.y) < TAPS_PX) {
    sendEvent({ type: 'double_click', x, y, button: 1, buttons: [1], modifiers: [] })
    tapped = null
  } else {
    tapped = { at, x, y }
  }
}

function leave (event) {
  if (event.type === 'pointerup' && event.pointerType === 'touch' && !pinching) { tap(event) }
  fingers.delete(event.pointerId)
  if (fingers.size === 0) { pinching = false }
}

for (const type of ['pointerdown', 'pointermove']) { window.addEventListener(type, count, { capture: true }) }
for (const type of ['pointerup', 'pointercancel']) { window.addEventListener(type, leave, { capture: true }) }
