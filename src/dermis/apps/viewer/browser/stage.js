// Progress of the preparation until the first picture, or the reason why there is none.

const TICK_MS = 1000
const place = document.getElementById('stage')
const words = document.createElement('p')
const bar = document.createElement('progress')
let stage = ''
let seconds = 0 // since the stage began
let clock = null

export function follow (message) {
  if (message.type === 'stage') {
    begin(message)
  } else if (message.type === 'failure') {
    end()
    words.textContent = message.text
    place.replaceChildren(words)
  } else if (message.type === 'framebufferdata') {
    end()
    place.replaceChildren()
  }
}

function begin ({ text, number, total }) {
  if (stage !== text) { seconds = 0 }
  stage = text
  bar.max = total
  bar.value = number - 1
  place.replaceChildren(words, bar)
  clock = clock || setInterval(() => { seconds += 1; update() }, TICK_MS)
  update()
}

function update () {
  words.textContent = `${stage} … (${bar.value + 1}/${bar.max})` + (seconds > 2 ? `, ${seconds} s` : '')
}

function end () {
  clearInterval(clock)
  clock = null
}
