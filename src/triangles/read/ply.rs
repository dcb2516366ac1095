//! PLY: a header that says what each record holds, then the records as text or as bytes.

use glam::DVec3;

use super::cut;

/// How numbers are written.
#[derive(Clone, Copy, PartialEq)]
enum Form {
    Text,
    LittleEndian,
    BigEndian,
}

#[derive(Clone, Copy)]
enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

/// A number of a record, or a list of them with the kind of its length.
struct Property {
    name: String,
    kind: Kind,
    length: Option<Kind>,
}

struct Element {
    name: String,
    count: usize,
    properties: Vec<Property>,
}

pub fn read(bytes: &[u8]) -> Result<Vec<[DVec3; 3]>, String> {
    let (form, elements, body) = header(bytes)?;
    let mut numbers = Numbers { form, rest: &bytes[body..] };
    let mut places = Vec::new();
    let mut triangles = Vec::new();
    for element in &elements {
        for _ in 0..element.count {
            if element.properties.is_empty() {
                break;
            }
            let (point, polygon) = record(element, &mut numbers)?;
            match element.name.as_str() {
                "vertex" => places.push(point),
                "face" => cut(&places, &polygon, &mut triangles)?,
                _ => {}
            }
        }
    }
    Ok(triangles)
}

/// The point and the polygon that a record has.
fn record(element: &Element, numbers: &mut Numbers<'_>) -> Result<(DVec3, Vec<usize>), String> {
    let (mut point, mut polygon) = (DVec3::NAN, Vec::new());
    for property in &element.properties {
        let Some(length) = property.length else {
            let value = numbers.next(property.kind)?;
            match property.name.as_str() {
                "x" => point.x = value,
                "y" => point.y = value,
                "z" => point.z = value,
                _ => {}
            }
            continue;
        };
        let length = numbers.next(length)?;
        if !(length >= 0.0 && length.fract() == 0.0) {
            return Err(format!("a list has {length} members"));
        }
        let is_polygon = matches!(property.name.as_str(), "vertex_indices" | "vertex_index");
        // a length that lies ends with the file
        for _ in 0..length as u64 {
            let member = numbers.next(property.kind)?;
            if is_polygon {
                if !(member >= 0.0 && member.fract() == 0.0) {
                    return Err(format!("a face names corner {member}"));
                }
                polygon.push(member as usize);
            }
        }
    }
    Ok((point, polygon))
}

/// The form, the elements, and where the records begin.
fn header(bytes: &[u8]) -> Result<(Form, Vec<Element>, usize), String> {
    let mut form = None;
    let mut elements: Vec<Element> = Vec::new();
    let mut at = 0;
    loop {
        let rest = &bytes[at..];
        let end = rest.iter().position(|&b| b == b'\n').ok_or("its header does not end")?;
        let line = std::str::from_utf8(&rest[..end]).map_err(|_| "its header is no text")?.trim();
        at += end + 1;
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        match words[..] {
            ["ply"] | ["comment" | "obj_info", ..] | [] => {}
            _ if !bytes.starts_with(b"ply") => return Err("it does not begin with `ply`".into()),
            ["format", "ascii", _] => form = Some(Form::Text),
            ["format", "binary_little_endian", _] => form = Some(Form::LittleEndian),
            ["format", "binary_big_endian", _] => form = Some(Form::BigEndian),
            ["element", name, count] => {
                let count = count.parse().map_err(|_| format!("its header has `{line}`"))?;
                elements.push(Element { name: name.into(), count, properties: Vec::new() });
            }
            ["property", "list", length, of, name] => {
                let property = Property { name: name.into(), kind: kind(of)?, length: Some(kind(length)?) };
                elements.last_mut().ok_or("a property belongs to no element")?.properties.push(property);
            }
            ["property", of, name] => {
                let property = Property { name: name.into(), kind: kind(of)?, length: None };
                elements.last_mut().ok_or("a property belongs to no element")?.properties.push(property);
            }
            ["end_header"] => break,
            _ => return Err(format!("its header has `{line}`")),
        }
    }
    Ok((form.ok_or("its header states no format")?, elements, at))
}

fn kind(word: &str) -> Result<Kind, String> {
    Ok(match word {
        "char" | "int8" => Kind::I8,
        "uchar" | "uint8" => Kind::U8,
        "short" | "int16" => Kind::I16,
        "ushort" | "uint16" => Kind::U16,
        "int" | "int32" => Kind::I32,
        "uint" | "uint32" => Kind::U32,
        "float" | "float32" => Kind::F32,
        "double" | "float64" => Kind::F64,
        _ => return Err(format!("its header has numbers of the kind `{word}`")),
    })
}

/// The numbers of the records, one after the other.
struct Numbers<'b> {
    form: Form,
    rest: &'b [u8],
}

impl Numbers<'_> {
    fn next(&mut self, kind: Kind) -> Result<f64, String> {
        if self.form == Form::Text {
            return self.word();
        }
        Ok(match kind {
            Kind::I8 => f64::from(i8::from_le_bytes(self.bytes()?)),
            Kind::U8 => f64::from(u8::from_le_bytes(self.bytes()?)),
            Kind::I16 => f64::from(i16::from_le_bytes(self.bytes()?)),
            Kind::U16 => f64::from(u16::from_le_bytes(self.bytes()?)),
            Kind::I32 => f64::from(i32::from_le_bytes(self.bytes()?)),
            Kind::U32 => f64::from(u32::from_le_bytes(self.bytes()?)),
            Kind::F32 => f64::from(f32::from_le_bytes(self.bytes()?)),
            Kind::F64 => f64::from_le_bytes(self.bytes()?),
        })
    }

    /// The given number of bytes, the lowest first.
    fn bytes<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let (taken, rest) = self.rest.split_first_chunk::<N>().ok_or("it ends too early")?;
        self.rest = rest;
        let mut taken = *taken;
        if self.form == Form::BigEndian {
            taken.reverse();
        }
        Ok(taken)
    }

    fn word(&mut self) -> Result<f64, String> {
        let rest = self.rest.trim_ascii_start();
        let end = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        self.rest = &rest[end..];
        let word = std::str::from_utf8(&rest[..end]).map_err(|_| "its records are no text")?;
        match word.parse() {
            Ok(number) => Ok(number),
            Err(_) if word.is_empty() => Err("it ends too early".into()),
            Err(_) => Err(format!("its records have `{word}` where a number should be")),
        }
    }
}
