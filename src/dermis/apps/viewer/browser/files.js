// Files between the page and the server: downloads of saved files, uploads of heads.

const shelf = document.getElementById('files')
const chooser = document.createElement('input')
let announced = null // name of the file whose bytes come next
let link = null
let ticket = '' // proof that this page has control, for uploads

chooser.type = 'file'
chooser.onchange = () => {
  send(chooser.files[0])
  chooser.value = '' // otherwise the same file could not be chosen again
}

export function take (message) {
  if (message.type === 'download') {
    announced = message.name
  } else if (message.type === 'ticket') {
    ticket = message.value
  } else if (message.type === 'choose') {
    choose(message.kinds)
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
  link.click() // the link remains, in case the browser asks first or blocks the download
}

// A browser may refuse to open its file dialog so long after the click, hence the button.
function choose (kinds) {
  chooser.accept = kinds
  const button = document.createElement('button')
  button.textContent = `choose a file (${kinds.replaceAll(',', ' ')})`
  button.onclick = () => chooser.click()
  show(button)
  chooser.click()
}

async function send (file) {
  if (!file) { return }
  show(`sending ${file.name} …`)
  try {
    const address = `upload/${encodeURIComponent(file.name)}`
    const answer = await fetch(address, { method: 'POST', headers: { 'x-dermis-ticket': ticket }, body: file })
    const text = await answer.text()
    if (answer.ok) { shelf.replaceChildren() } else { show(text) }
  } catch (error) {
    show(`${file.name} could not be sent: is it too large, or the connection lost?`)
  }
}

function show (...parts) {
  const close = document.createElement('button')
  close.textContent = '×'
  close.title = 'close'
  close.onclick = () => shelf.replaceChildren()
  shelf.replaceChildren(...parts, close)
}

window.addEventListener('dragover', (event) => event.preventDefault())
window.addEventListener('drop', (event) => {
  event.preventDefault()
  send(event.dataTransfer.files[0])
})
