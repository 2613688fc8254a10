//! A YOLOX network made by hand, so that tests need no trained one: it finds red and blue squares.
#![allow(dead_code, reason = "each test takes what it needs")]

use std::fs;
use std::path::Path;

use dymlm::core::{ColorImage, Rgb};
use prost::Message;
use tract_onnx::pb::attribute_proto::AttributeType;
use tract_onnx::pb::tensor_proto::DataType;
use tract_onnx::pb::tensor_shape_proto::{Dimension, dimension};
use tract_onnx::pb::{
    AttributeProto, GraphProto, ModelProto, NodeProto, OperatorSetIdProto, TensorProto, TensorShapeProto,
    TypeProto, ValueInfoProto, type_proto,
};

pub(crate) const RED: Rgb = [255, 0, 0];
pub(crate) const BLUE: Rgb = [0, 0, 255];
pub(crate) const GREY: Rgb = [114; 3];

/// A network in which the cells of one grid detect how red or blue they are; all other cells detect nothing.
///
/// Each grid is a convolution as wide as its stride: the mean colour of a cell decides whether there is
/// anything (neither grey nor green) and whether it is red (class 0) or blue (class 1). Boxes are the cells.
#[derive(Clone)]
pub(crate) struct ColorNetwork {
    /// Width and height of its input, pixels.
    pub size: [i64; 2],
    /// Stride of the grid that detects.
    pub stride: i64,
    /// Whether it takes any number of images at once.
    pub any_batch: bool,
    /// Whether scores go through the sigmoid.
    pub has_sigmoid: bool,
    /// Whether there is a row for each cell, as there should be.
    pub rows_are_cells: bool,
}

impl ColorNetwork {
    pub(crate) fn new(size: [i64; 2], stride: i64) -> Self {
        Self { size, stride, any_batch: false, has_sigmoid: true, rows_are_cells: true }
    }

    pub(crate) fn write(&self, path: &Path) {
        fs::write(path, self.onnx().encode_to_vec()).unwrap();
    }

    fn onnx(&self) -> ModelProto {
        let mut graph = GraphProto { name: "colors".into(), ..Default::default() };
        let mut grids = Vec::new();
        for stride in [8, 16, 32] {
            self.add_grid(&mut graph, stride);
            grids.push(format!("cells_{stride}"));
        }
        let grids: Vec<&str> = grids.iter().map(String::as_str).collect();
        graph.node.push(node("Concat", &grids, "columns", &[int("axis", 2)]));
        let order: &[i64] = if self.rows_are_cells { &[0, 2, 1] } else { &[0, 1, 2] };
        graph.node.push(node("Transpose", &["columns"], "output", &[ints("perm", order)]));
        let batch = if self.any_batch {
            dimension::Value::DimParam("batch".into())
        } else {
            dimension::Value::DimValue(1)
        };
        let sides = [3, self.size[1], self.size[0]].map(dimension::Value::DimValue);
        graph.input.push(value("images", Some([batch].into_iter().chain(sides).collect())));
        graph.output.push(value("output", None));
        ModelProto {
            ir_version: 8,
            opset_import: vec![OperatorSetIdProto { domain: String::new(), version: 13 }],
            graph: Some(graph),
            ..Default::default()
        }
    }

    fn add_grid(&self, graph: &mut GraphProto, stride: i64) {
        let cell = (stride * stride) as usize;
        // Blue, green and red planes: see the type's comment.
        let (unsure, steepness) = (if stride == self.stride { -8.0 } else { -80.0 }, 0.08 / cell as f32);
        let weights = [[1.0, -2.0, 1.0], [-1.0, 0.0, 1.0], [1.0, 0.0, -1.0]]
            .as_flattened()
            .iter()
            .flat_map(|weight| vec![weight * steepness; cell]);
        Self::add_convolution(graph, "scores", stride, weights.collect(), &[unsure, 0.0, 0.0]);
        let nothing = vec![0.0; 4 * 3 * cell];
        Self::add_convolution(graph, "boxes", stride, nothing, &[0.5, 0.5, 0.0, 0.0]);

        let named = |what: &str| format!("{what}_{stride}");
        let scores = if self.has_sigmoid {
            graph.node.push(node("Sigmoid", &[&named("scores")], &named("probabilities"), &[]));
            named("probabilities")
        } else {
            named("scores")
        };
        graph.node.push(node("Concat", &[&named("boxes"), &scores], &named("both"), &[int("axis", 1)]));
        graph.initializer.push(TensorProto {
            dims: vec![3],
            data_type: DataType::Int64 as i32,
            int64_data: vec![1, 7, -1],
            name: named("shape"),
            ..Default::default()
        });
        graph.node.push(node("Reshape", &[&named("both"), &named("shape")], &named("cells"), &[]));
    }

    fn add_convolution(graph: &mut GraphProto, name: &str, stride: i64, weights: Vec<f32>, bias: &[f32]) {
        let [output, weight_name, bias_name] = ["", "_w", "_b"].map(|end| format!("{name}_{stride}{end}"));
        let channels = bias.len() as i64;
        graph.initializer.push(floats(&weight_name, vec![channels, 3, stride, stride], weights));
        graph.initializer.push(floats(&bias_name, vec![channels], bias.to_vec()));
        let sides = [stride, stride];
        let attributes = [ints("kernel_shape", &sides), ints("strides", &sides)];
        graph.node.push(node("Conv", &["images", &weight_name, &bias_name], &output, &attributes));
    }
}

/// A grey image with squares: colour, left and upper side, and side length.
pub(crate) fn image_of(size: [usize; 2], squares: &[(Rgb, [usize; 2], usize)]) -> ColorImage {
    let mut pixels = vec![GREY; size[0] * size[1]];
    for &(color, [left, upper], side) in squares {
        for v in upper..upper + side {
            pixels[v * size[0] + left..][..side].fill(color);
        }
    }
    ColorImage::new(size[0], size[1], pixels).unwrap()
}

fn node(kind: &str, input: &[&str], output: &str, attributes: &[AttributeProto]) -> NodeProto {
    NodeProto {
        input: input.iter().map(ToString::to_string).collect(),
        output: vec![output.to_owned()],
        name: output.to_owned(),
        op_type: kind.to_owned(),
        attribute: attributes.to_vec(),
        ..Default::default()
    }
}

fn int(name: &str, i: i64) -> AttributeProto {
    AttributeProto { name: name.to_owned(), r#type: AttributeType::Int as i32, i, ..Default::default() }
}

fn ints(name: &str, ints: &[i64]) -> AttributeProto {
    let (name, ints) = (name.to_owned(), ints.to_vec());
    AttributeProto { name, r#type: AttributeType::Ints as i32, ints, ..Default::default() }
}

fn floats(name: &str, dims: Vec<i64>, float_data: Vec<f32>) -> TensorProto {
    TensorProto {
        dims,
        data_type: DataType::Float as i32,
        float_data,
        name: name.to_owned(),
        ..Default::default()
    }
}

fn value(name: &str, shape: Option<Vec<dimension::Value>>) -> ValueInfoProto {
    let dimension = |value| Dimension { value: Some(value), ..Default::default() };
    let shape = shape.map(|sides| TensorShapeProto { dim: sides.into_iter().map(dimension).collect() });
    let tensor = type_proto::Tensor { elem_type: DataType::Float as i32, shape };
    ValueInfoProto {
        name: name.to_owned(),
        r#type: Some(TypeProto { value: Some(type_proto::Value::TensorType(tensor)), ..Default::default() }),
        ..Default::default()
    }
}
