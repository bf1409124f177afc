//! Images and their PNG form.

use super::canvas::PIXELS_PER_POINT;
use super::provenance::Provenance;
use limitlab::Result;
use limitlab::output::write_file;
use std::io::{self, Write};
use std::path::Path;

/// The resolution of figures: a point is 1/72 inch.
const PIXELS_PER_METRE: u32 = (PIXELS_PER_POINT as f64 * 72.0 / 0.0254 + 0.5) as u32;

/// An image of 8-bit red, green, blue.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    /// In pixels.
    pub width: u32,
    pub height: u32,
    /// Three bytes a pixel, row by row from the top left: 3·width·height bytes.
    pub rgb: Vec<u8>,
}

impl Image {
    /// The image whose pixels are the averages of `factor`×`factor` blocks of this one; what does not fill a
    /// block at the right and the bottom is left out. Cost: one pass.
    pub fn reduced(&self, factor: u32) -> Image {
        let (width, height) = (self.width / factor, self.height / factor);
        let factor = factor as usize;
        let (row, out_row) = (3 * self.width as usize, 3 * width as usize);
        let count = (factor * factor) as u32;
        let mut rgb = Vec::with_capacity(out_row * height as usize);
        let mut sums = vec![0_u32; out_row];
        for lines in self.rgb.chunks(factor * row).take(height as usize) {
            sums.fill(0);
            for line in lines.chunks(row) {
                for (sum, block) in sums.chunks_mut(3).zip(line.chunks_exact(3 * factor)) {
                    for pixel in block.chunks(3) {
                        for (s, &p) in sum.iter_mut().zip(pixel) {
                            *s += u32::from(p);
                        }
                    }
                }
            }
            rgb.extend(sums.iter().map(|&s| ((s + count / 2) / count) as u8));
        }
        Image { width, height, rgb }
    }

    /// The colour of the pixel in column `x` and row `y`.
    ///
    /// # Panics
    /// If there is no such pixel.
    pub fn pixel(&self, x: u32, y: u32) -> [u8; 3] {
        assert!(x < self.width && y < self.height, "pixel inside the image");
        let at = 3 * (y as usize * self.width as usize + x as usize);
        [self.rgb[at], self.rgb[at + 1], self.rgb[at + 2]]
    }

    /// Writes the image as PNG: RGB, 8 bits, 216 pixels an inch, no time stamp, so that the same image gives the same bytes.
    ///
    /// # Errors
    /// Those of `out`, and a width or height of 0.
    pub fn write_png(&self, out: &mut dyn Write) -> io::Result<()> {
        self.write(out, &Provenance::default())
    }

    fn write(&self, out: &mut dyn Write, provenance: &Provenance) -> io::Result<()> {
        let mut writer = self.encoder(out, provenance)?.write_header()?;
        writer.write_image_data(&self.rgb)?;
        Ok(writer.finish()?)
    }

    /// With the lines of the provenance as chunks of text.
    fn encoder<W: Write>(&self, out: W, provenance: &Provenance) -> io::Result<png::Encoder<'static, W>> {
        let mut encoder = png::Encoder::new(out, self.width, self.height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::High);
        // Drawings are runs of one colour, which deflate sees best unfiltered.
        encoder.set_filter(png::Filter::NoFilter);
        let unit = png::Unit::Meter;
        encoder.set_pixel_dims(Some(png::PixelDimensions { xppu: PIXELS_PER_METRE, yppu: PIXELS_PER_METRE, unit }));
        for line in provenance.lines() {
            let (keyword, text) = line.split_once(": ").unwrap_or(("Comment", &line));
            encoder.add_itxt_chunk(keyword.into(), text.into())?;
        }
        Ok(encoder)
    }

    /// Writes the PNG file at `path`, which says what made it.
    ///
    /// # Errors
    /// [`Error::Io`](limitlab::Error::Io) if it cannot be written.
    pub fn save(&self, path: &Path, provenance: &Provenance) -> Result<()> {
        write_file(path, |out| self.write(out, provenance))
    }
}

/// Images of one size shown one after the other, again and again: an animated PNG, which every browser plays, and of
/// which other programs show the first image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Animation {
    pub frames: Vec<Image>,
    /// How long each image is shown; the last one three times as long.
    pub milliseconds: u16,
}

impl Animation {
    /// Writes the animated PNG, which says what made it.
    ///
    /// # Errors
    /// Those of `out`; no image at all, or images of different sizes.
    pub fn write_png(&self, out: &mut dyn Write, provenance: &Provenance) -> io::Result<()> {
        let refuse = |what| io::Error::new(io::ErrorKind::InvalidInput, what);
        let (Some(first), Ok(count)) = (self.frames.first(), u32::try_from(self.frames.len())) else {
            return Err(refuse("an animation needs an image"));
        };
        let size = |image: &Image| (image.width, image.height);
        if self.frames.iter().any(|f| size(f) != size(first)) {
            return Err(refuse("the images of an animation are of one size"));
        }
        let mut encoder = first.encoder(out, provenance)?;
        encoder.set_animated(count, 0)?;
        let mut writer = encoder.write_header()?;
        for (i, frame) in (1..).zip(&self.frames) {
            let times = if i == count { 3 } else { 1 };
            writer.set_frame_delay(self.milliseconds.saturating_mul(times), 1000)?;
            writer.write_image_data(&frame.rgb)?;
        }
        Ok(writer.finish()?)
    }

    /// Writes the file at `path`.
    ///
    /// # Errors
    /// [`Error::Io`](limitlab::Error::Io) if it cannot be written.
    pub fn save(&self, path: &Path, provenance: &Provenance) -> Result<()> {
        write_file(path, |out| self.write_png(out, provenance))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reduction_averages_blocks() {
        // 5×4 pixels, red = 10·row + column; the fifth column fills no 2×2 block.
        let rgb = (0..20).flat_map(|i| [10 * (i / 5) + i % 5, 7, 255]);
        let image = Image { width: 5, height: 4, rgb: rgb.collect() };
        let half = image.reduced(2);
        assert_eq!((half.width, half.height), (2, 2));
        // Mean of {0, 1, 10, 11} is 5.5, rounded up.
        assert_eq!(half.pixel(0, 0), [6, 7, 255]);
        assert_eq!(half.pixel(1, 0), [8, 7, 255]);
        assert_eq!(half.pixel(0, 1), [26, 7, 255]);
        assert_eq!(image.reduced(1), image);
    }

    #[test]
    fn a_png_decodes_to_its_image() {
        let rgb: Vec<u8> = (0..3 * 7 * 5).map(|i| (i * 37 % 256) as u8).collect();
        let image = Image { width: 7, height: 5, rgb };
        let mut bytes = Vec::new();
        image.write_png(&mut bytes).unwrap();
        let mut reader = png::Decoder::new(io::Cursor::new(&bytes)).read_info().unwrap();
        let mut decoded = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut decoded).unwrap();
        assert_eq!((info.width, info.height), (7, 5));
        assert_eq!(decoded, image.rgb);
        // 216 pixels an inch of 25.4 mm.
        let resolution = reader.info().pixel_dims.unwrap();
        assert_eq!((resolution.xppu, resolution.yppu, resolution.unit), (8504, 8504, png::Unit::Meter));
    }

    #[test]
    fn an_animation_decodes_to_its_images() {
        let frame = |shade: u8| Image { width: 4, height: 3, rgb: (0..36).map(|i| shade.wrapping_add(i)).collect() };
        let animation = Animation { frames: [7, 90, 200].map(frame).to_vec(), milliseconds: 400 };
        let mut bytes = Vec::new();
        animation.write_png(&mut bytes, &Provenance::default()).unwrap();
        let mut reader = png::Decoder::new(io::Cursor::new(&bytes)).read_info().unwrap();
        let control = *reader.info().animation_control().unwrap();
        assert_eq!((control.num_frames, control.num_plays), (3, 0));
        for (i, image) in animation.frames.iter().enumerate() {
            let mut decoded = vec![0; reader.output_buffer_size().unwrap()];
            reader.next_frame(&mut decoded).unwrap();
            assert_eq!(decoded, image.rgb);
            let shown = reader.info().frame_control().unwrap();
            let expected = if i == 2 { 1200 } else { 400 };
            assert_eq!((shown.delay_num, shown.delay_den), (expected, 1000));
        }
        let mut odd = animation.clone();
        odd.frames[1].width = 2;
        assert!(odd.write_png(&mut Vec::new(), &Provenance::default()).is_err());
        odd.frames.clear();
        assert!(odd.write_png(&mut Vec::new(), &Provenance::default()).is_err());
    }

    #[test]
    fn an_image_without_pixels_is_an_error() {
        let image = Image { width: 0, height: 0, rgb: vec![] };
        assert!(image.write_png(&mut Vec::new()).is_err());
    }
}
