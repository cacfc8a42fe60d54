// Files between the page and the server: what is saved is offered as a download.

const shelf = document.getElementById('files')
let announced = null // name of the file whose bytes come next
let link = null

export function take (message) {
  if (message.type === 'download') {
    announced = message.name
  } else if (announced !== null && message.bytes) {
    offer(announced, message.bytes)
    announced = null
  }
}

function offer (name, bytes) {
  if (link) { URL.revokeObjectURL(link.href) }
  link = document.createElement('a')
  link.href = URL.createObjectURL(bytes)
  link.download = link.textContent = name
  show('saved ', link)
  link.click() // the link stays, for a browser that asks first or keeps nothing
}

function show (...parts) {
  const close = document.createElement('button')
  close.textContent = '×'
  close.title = 'close'
  close.onclick = () => shelf.replaceChildren()
  shelf.replaceChildren(...parts, close)
}
