//! Words of the texts that say how something is shown: names with their signs escaped, and colours.

/// The colour that six hexadecimal digits stand for: two each of red, green and blue.
pub(crate) fn color_of(text: &str) -> Option<[u8; 3]> {
    let is_hex = text.len() == 6 && text.bytes().all(|byte| byte.is_ascii_hexdigit());
    let code = u32::from_str_radix(text, 16).ok().filter(|_| is_hex)?;
    Some([code >> 16, code >> 8, code].map(|code| code as u8))
}

/// A name without what has a meaning in texts.
pub(crate) fn escaped(name: &str) -> String {
    let is_plain = |c: char| !c.is_whitespace() && !c.is_control() && !":;=%#".contains(c);
    let mut text = String::with_capacity(name.len());
    for character in name.chars() {
        if is_plain(character) {
            text.push(character);
        } else {
            let mut bytes = [0; 4];
            for byte in character.encode_utf8(&mut bytes).bytes() {
                text += &format!("%{byte:02X}");
            }
        }
    }
    text
}

/// The name that was escaped. A percent sign without two digits after it is one.
pub(crate) fn unescaped(text: &str) -> String {
    let (bytes, mut name) = (text.as_bytes(), Vec::with_capacity(text.len()));
    let mut at = 0;
    while at < bytes.len() {
        let code = bytes.get(at + 1..at + 3).filter(|_| bytes[at] == b'%');
        let code = code.and_then(|digits| std::str::from_utf8(digits).ok());
        match code.filter(|digits| digits.bytes().all(|digit| digit.is_ascii_hexdigit())) {
            Some(digits) => {
                name.push(u8::from_str_radix(digits, 16).unwrap_or(b'%'));
                at += 3;
            }
            None => {
                name.push(bytes[at]);
                at += 1;
            }
        }
    }
    String::from_utf8(name).unwrap_or_else(|_| text.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_come_back_whatever_signs_they_have() {
        for name in ["height", "a:b;c d", "50 %", "%41", "ä\u{1F30D}\n", ""] {
            let text = escaped(name);
            assert!(!text.contains([':', ';', ' ', '\n']), "{text}");
            assert_eq!(unescaped(&text), name);
        }
        assert_eq!(unescaped("%4"), "%4", "a sign without two digits is itself");
        assert_eq!(unescaped("%ff"), "%ff", "what is no text stays as it is");
    }

    #[test]
    fn colours_are_six_digits() {
        assert_eq!(color_of("ff0080"), Some([255, 0, 128]));
        for bad in ["", "ff008", "ff00800", "+f0080", "gg0080", "äää"] {
            assert_eq!(color_of(bad), None, "{bad}");
        }
    }
}
