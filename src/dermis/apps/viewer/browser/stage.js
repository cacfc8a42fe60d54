// What is being prepared until there is a picture, or why there will be none.

const TICK_MS = 1000
const place = document.getElementById('stage')
const words = document.createElement('p')
const bar = document.createElement('progress')
let said = '' // the stage
let seconds = 0 // since it began
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

function begin ({ text, number, of }) {
  if (said !== text) { seconds = 0 }
  said = text
  bar.max = of
  bar.value = number - 1
  place.replaceChildren(words, bar)
  clock = clock || setInterval(() => { seconds += 1; tell() }, TICK_MS)
  tell()
}

function tell () {
  words.textContent = `${said} … (${bar.value + 1}/${bar.max})` + (seconds > 2 ? `, ${seconds} s` : '')
}

function end () {
  clearInterval(clock)
  clock = null
}
