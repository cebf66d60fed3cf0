//! Words and a colour bar on a picture.

use super::render::water;
use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};

/// Colour of words.
const INK: [u8; 3] = [40, 44, 52];

/// A picture of three bytes a pixel, in rows.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Pixels in a row.
    pub width: usize,
    /// The bytes.
    pub bytes: Vec<u8>,
}

impl Picture {
    /// Rows.
    pub fn height(&self) -> usize {
        self.bytes.len() / 3 / self.width.max(1)
    }

    /// The file, as PNG.
    pub fn png(&self) -> Vec<u8> {
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, self.width as u32, self.height() as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder
            .write_header()
            .and_then(|mut writer| writer.write_image_data(&self.bytes).and_then(|()| writer.finish()))
            .expect("a Vec takes everything");
        file
    }

    fn mix(&mut self, x: usize, y: usize, color: [u8; 3], part: u8) {
        if x < self.width && y < self.height() {
            let at = 3 * (y * self.width + x);
            for (own, new) in self.bytes[at..at + 3].iter_mut().zip(color) {
                let sum = u32::from(*own) * u32::from(255 - part) + u32::from(new) * u32::from(part);
                *own = (sum / 255) as u8;
            }
        }
    }

    /// Letters, and pixels of the picture for each of theirs: another size of them would be a hundredth of the program.
    fn letters(&self) -> (RasterHeight, usize) {
        match self.height() {
            0..600 => (RasterHeight::Size16, 1),
            600..1800 => (RasterHeight::Size24, 1),
            _ => (RasterHeight::Size24, 2),
        }
    }

    /// Height of a line and width of a letter [pixels].
    fn letter(&self) -> [usize; 2] {
        let (size, scale) = self.letters();
        [size.val(), get_raster_width(FontWeight::Regular, size)].map(|n| scale * n)
    }

    /// Write `text` with its upper left corner at `x`, `y`.
    fn write(&mut self, x: usize, y: usize, text: &str) {
        let (size, scale) = self.letters();
        let [_, each] = self.letter();
        for (k, c) in text.chars().enumerate() {
            let Some(raster) = get_raster(c, FontWeight::Regular, size) else { continue };
            for (dy, row) in raster.raster().iter().enumerate() {
                for (dx, &part) in row.iter().enumerate() {
                    for (own_y, own_x) in (0..scale).flat_map(|i| (0..scale).map(move |j| (i, j))) {
                        self.mix(x + k * each + scale * dx + own_x, y + scale * dy + own_y, INK, part);
                    }
                }
            }
        }
    }

    fn length(&self, text: &str) -> usize {
        text.chars().count() * self.letter()[1]
    }

    /// Lighten a rectangle, so that words on it are read whatever lies behind.
    fn plate(&mut self, x: usize, y: usize, width: usize, height: usize) {
        for y in y..(y + height).min(self.height()) {
            (x..(x + width).min(self.width)).for_each(|x| self.mix(x, y, [250, 251, 252], 190));
        }
    }

    /// The time, as it is `told`, in the upper left corner.
    pub fn time(&mut self, told: &str) {
        let [letter, _] = self.letter();
        let edge = letter / 2;
        self.plate(edge / 2, edge / 2, self.length(told) + edge, letter + edge);
        self.write(edge, edge, told);
    }

    /// A bar of the colours in the upper right corner, from `range[0]` to `range[1]`, called `name`; none in a picture that
    /// it would cover, or in which it would meet the time, as it is `told`.
    pub fn bar(&mut self, name: &str, range: [f64; 2], told: &str) {
        let [letter, _] = self.letter();
        let (width, edge) = ((self.width / 4).max(8 * letter).min(self.width), letter / 2);
        let (left, high) = (self.width.saturating_sub(width + 2 * edge), letter / 2);
        let bottom = edge + letter + letter / 8;
        let beside = self.length(told) + 2 * edge;
        if left < beside + edge || 3 * (bottom + high + letter) > self.height() {
            return;
        }
        self.plate(left.saturating_sub(edge), edge / 2, width + 2 * edge, bottom + high + letter + edge / 2);
        for x in 0..width {
            let color = water(x as f32 / width.max(2) as f32).to_array().map(|c| (255.0 * c).round() as u8);
            (0..high).for_each(|y| self.mix(left + x, bottom + y, color, 255));
        }
        let below = bottom + high + letter / 8;
        let (low, most) = (short(range[0]), short(range[1]));
        self.write(left, below, &low);
        self.write((left + width).saturating_sub(self.length(&most)), below, &most);
        let middle = (width.saturating_sub(self.length(name))) / 2;
        // Above the bar, so that it meets no number.
        self.write(left + middle, edge, name);
    }
}

/// A number in few digits.
fn short(x: f64) -> String {
    if x == 0.0 || (1e-2..1e5).contains(&x.abs()) {
        let digits = (2.0 - x.abs().max(1e-9).log10().floor()).clamp(0.0, 3.0) as usize;
        let text = format!("{x:.digits$}");
        let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
        return text.to_owned();
    }
    format!("{x:.1e}")
}

/// Pictures of the same size side by side, `columns` in a row.
pub fn sheet(pictures: &[Picture], columns: usize) -> Option<Picture> {
    let first = pictures.first()?;
    let (w, h) = (first.width, first.height());
    let columns = columns.clamp(1, pictures.len());
    let rows = pictures.len().div_ceil(columns);
    let mut out = Picture { width: columns * w, bytes: vec![255; 3 * columns * w * rows * h] };
    for (k, picture) in pictures.iter().enumerate() {
        let (left, top) = (k % columns * w, k / columns * h);
        for y in 0..h {
            let to = 3 * ((top + y) * out.width + left);
            out.bytes[to..to + 3 * w].copy_from_slice(&picture.bytes[3 * y * w..3 * (y + 1) * w]);
        }
    }
    Some(out)
}

/// An animation of pictures of the same size as animated PNG, `rate` of them a second.
pub fn animation(pictures: &[Picture], rate: u16) -> Option<Vec<u8>> {
    let first = pictures.first()?;
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, first.width as u32, first.height() as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_animated(u32::try_from(pictures.len()).ok()?, 0).ok()?;
    encoder.set_frame_delay(1, rate.max(1)).ok()?;
    let mut writer = encoder.write_header().ok()?;
    pictures.iter().try_for_each(|p| writer.write_image_data(&p.bytes)).ok()?;
    writer.finish().ok()?;
    Some(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        for (x, text) in [(0.0, "0"), (2.5, "2.5"), (1200.0, "1200"), (0.031, "0.031"), (3.4e6, "3.4e6")] {
            assert_eq!(short(x), text);
        }
    }

    #[test]
    fn words_stay_inside_and_leave_ink() {
        let blank = Picture { width: 300, bytes: vec![255; 3 * 300 * 200] };
        let mut written = blank.clone();
        written.time("t = 1.250 s");
        let before = written.bytes.clone();
        written.bar("speed [m/s]", [0.0, 2.5], "t = 1.250 s");
        assert_ne!(written.bytes, before);
        let ink = written.bytes.iter().zip(&blank.bytes).filter(|(a, b)| a != b).count();
        assert!(ink > 3000, "{ink}");
        // Too small for words: nothing is written beside it.
        let mut tiny = Picture { width: 3, bytes: vec![255; 3 * 3 * 2] };
        tiny.time("t = 1.000 s");
        tiny.bar("x", [0.0, 1.0], "t = 1.000 s");
        // Where it would cover the scene or the time there is no bar.
        for (width, height) in [(200, 100), (240, 400), (400, 100)] {
            let mut small = Picture { width, bytes: vec![255; 3 * width * height] };
            small.bar("speed [m/s]", [0.0, 2.5], "t = 1.250 s");
            assert!(small.bytes.iter().all(|&b| b == 255), "{width} x {height}");
        }
        let all = sheet(&[blank.clone(), written.clone(), blank], 2).unwrap();
        assert_eq!((all.width, all.height()), (600, 400));
        assert_eq!(all.bytes[3 * 300..3 * 600], written.bytes[..3 * 300]);
        assert!(animation(&[written.clone(), written], 10).unwrap().starts_with(b"\x89PNG"));
    }
}
