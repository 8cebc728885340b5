!> Init files: what is accepted, and every way a file can be wrong.
module frb_test_files
    use frb_checks, only: tally
    use frb_file_cases, only: identity, nl, path, says, write_text
    use frb_init_files, only: init_values, read_init_file, whole_steps
    use frb_kinds, only: wp
    implicit none
    private

    public :: test_files

contains

    subroutine test_files(t)
        type(tally), intent(inout) :: t

        call test_accepted(t)
        call test_refused_text(t)
        call test_refused_values(t)
        call test_steps(t)
    end subroutine test_files

    !> Forms that a file may have, and the files of the package.
    subroutine test_accepted(t)
        type(tally), intent(inout) :: t
        real(wp), parameter :: a4 = 0.314241403071447_wp
        type(init_values) :: values
        character(:), allocatable :: error
        integer :: example
        character :: digit

        call t%open_suite('files-accepted', 22)
        do example = 0, 4
            digit = achar(iachar('0') + example)
            call read_init_file('data/init_example'//digit//'.dat', example, values, error)
            call t%ok('shipped-file-is-read', .not. allocated(error))
            if (example == 1) then
                call t%close_to('shipped-coefficients-sum-to-one', &
                                [2*sum(values%a(:7)) + values%a(8), 2*sum(values%b)], [1.0_wp, 1.0_wp], &
                                            2.3e-16_wp)
                call t%close_to('shipped-a4-is-the-corrected-one', values%a(4), a4, 0.0_wp)
                call t%equal('shipped-run-has-100000-steps', values%steps, 100000)
                call t%close_to('last-item-is-read-in-place', values%u0(3), -8.6772148817192390e-04_wp, &
                            0.0_wp)
            end if
        end do

        call write_text('0.5 1 2 3'//nl//'4 5 6'//nl//identity)
        call read_init_file(path, 0, values, error)
        call t%ok('plain-file-is-read', .not. allocated(error))
        call t%close_to('plain-file-gives-its-values', [values%h, values%moments, values%m], &
                        [0.5_wp, 1.0_wp, 2.0_wp, 3.0_wp, 4.0_wp, 5.0_wp, 6.0_wp], 0.0_wp)
        call t%close_to('one-step-ends-at-h', values%t_final, 0.5_wp, 0.0_wp)

        ! A rotation about axis 3: its first column is (0, 1, 0).
        call write_text('1 1 1 1 0 0 0'//nl//'0 1 0  -1 0 0  0 0 1')
        call read_init_file(path, 0, values, error)
        call t%close_to('matrix-is-read-column-by-column', values%attitude(:, 1), [0.0_wp, 1.0_wp, &
                    0.0_wp], 0.0_wp)

        call write_text('# title'//nl//nl//achar(9)//'.5D0!h'//achar(13)//nl//'+1.e0 2d+0 30E-1#I'//nl// &
                        '-4.0d00 .5e1 6.'//nl//'! Q'//nl//'1 0 0 0 1 0 0 0'//nl//'1'//nl//nl//'# end')
        call read_init_file(path, 0, values, error)
        call t%ok('comments-tabs-foreign-line-ends-and-d-exponents-are-read', .not. allocated(error))
        call t%close_to('every-way-to-write-a-number-is-understood', [values%h, values%moments, values%m], &
                        [0.5_wp, 1.0_wp, 2.0_wp, 3.0_wp, -4.0_wp, 5.0_wp, 6.0_wp], 0.0_wp)

        call write_text('1 1 1 1 1e100 -1.000e+0100 1000e97 1 0 0 0 1 0 0 0 1e-400')
        call read_init_file(path, 0, values, error)
        call t%ok('underflow-reaches-the-check-of-the-matrix', says(error, 'Q'))
        call write_text('1 1 1 1 1e100 -1.000e+0100 0001000e0000000000097'//nl//identity)
        call read_init_file(path, 0, values, error)
        call t%close_to('largest-numbers-are-read', values%m/1.0e100_wp, [1.0_wp, -1.0_wp, 1.0_wp], 0.0_wp)

        call write_text('-1 1 1 1 0 0 0  3 0 0 4')
        call read_init_file(path, 2, values, error)
        call t%close_to('quaternion-is-normalised', values%q, [0.6_wp, 0.0_wp, 0.0_wp, 0.8_wp], &
                    epsilon(1.0_wp))
        call t%close_to('negative-step-is-read', values%h, -1.0_wp, 0.0_wp)
        call write_text('-0.3 -10 0 0 0  1 0 0 0  1 1 1  12')
        call read_init_file(path, 4, values, error)
        call t%equal('run-back-in-time-has-its-steps', values%steps, 33)
        call t%close_to('step-is-reset-to-end-over-steps', values%h, -10.0_wp/33, 0.0_wp)
        call t%equal('points-are-read', values%points, 12)
        call t%close_suite()
    end subroutine test_accepted

    !> Text with too few or too many numbers, or other words: refused with file, line, item and expectation.
    subroutine test_refused_text(t)
        type(tally), intent(inout) :: t
        character(*), parameter :: words(15) = [character(12) :: 'x', 'NaN', '-Inf', '1.2.3', '1e', '1e+', &
            '1;0', '--1', '.', '0*1.0', '1+5.', '+2*1.0', '3*', '2*x', '1*1*1']
        character(*), parameter :: large(6) = [character(24) :: '1e309', '-1e999999999999', '1.0001e100', &
                                               '11e99', '1000000d1000', '0.0001e105']
        type(init_values) :: values
        character(:), allocatable :: error
        integer :: i

        call t%open_suite('files-refused-text', 15 + 6 + 20)
        do i = 1, size(words)
            call refuse(t, 'word-that-is-no-number-is-refused', 0, '1'//nl//'1 '//trim(words(i))// &
                        ' 1 0 0 0'//nl//identity, &
                        "line 2: I(2): expected a number, found '"//trim(words(i))//"'")
        end do
        do i = 1, size(large)
            call refuse(t, 'number-beyond-all-use-is-refused', 0, '1'//nl//'1 1 1 '//nl//'0 '// &
                        trim(large(i))//nl, &
                        "line 3: m(2): expected a number of magnitude at most 1e100, found '"// &
                                    trim(large(i))//"'")
        end do
        call refuse(t, 'empty-file-is-refused', 0, '', &
                    'line 0: h: expected a number, found the end of the file')
        call refuse(t, 'file-of-comments-is-refused', 1, '# 1 2 3'//nl//'!', &
                    'line 2: a(1): expected a number, found the end of the file')
        call refuse(t, 'short-file-is-refused', 0, '1 1 1 1 0 0 0'//nl//'1 0 0 0 1 0 0 0', &
                    'line 2: Q(9): expected a number, found the end of the file')
        call refuse(t, 'long-file-is-refused', 0, '1 1 1 1 0 0 0'//nl//identity//'7', &
                    "line 3: after Q(9): expected the end of the file, found '7'")
        call refuse(t, 'number-after-the-last-one-is-refused', 2, '1 1 1 1 0 0 0 1 0 0 0 , 3*5', &
                    "line 1: after q(4): expected the end of the file, found '3*5'")
        call refuse(t, 'junk-after-np-is-refused', 4, '1 1 0 0 0 1 0 0 0 1 1 1 5 5', &
                    "after np: expected the end")
        call refuse(t, 'missing-np-is-refused', 4, '1 1 0 0 0 1 0 0 0 1 1 1 ', &
                    'np: expected a number, found the end')
        call refuse(t, 'file-of-another-example-is-refused', 2, '1 1 1 1 0 0 0'//nl//identity, &
                    'after q(4): expected')
        call refuse(t, 'message-says-what-the-file-should-hold', 3, '', &
                    '(example 3 has h, Tfin, m(3), Q(9), I(3), np)')
        call refuse(t, 'unprintable-characters-are-not-printed', 0, achar(27)//'[2J', "found '?[2J'")
        call refuse(t, 'long-word-is-cut', 0, repeat('x', 4000), "found '"//repeat('x', 40)//"...'")
        call refuse(t, 'file-without-line-ends-is-refused', 0, repeat(' ', 300000), &
                    'expected at most 100000 characters, found more')
        call refuse(t, 'error-begins-with-the-path', 0, '', path//', line')

        call read_init_file('build/there_is_no_such_file.dat', 0, values, error)
        call t%ok('missing-file-is-refused', says(error, 'build/there_is_no_such_file.dat: cannot be opened'))
        call read_init_file('build', 0, values, error)
        call t%ok('folder-is-refused', says(error, 'build'))
        call read_init_file('', 0, values, error)
        call t%ok('empty-name-is-refused', allocated(error))
        call read_init_file('data/init_example0.dat', 5, values, error)
        call t%ok('unknown-example-is-refused', says(error, 'no init file of this example'))
        call write_text('1 1 1 1 0 0 0'//nl//identity)
        call read_init_file(path, 0, values, error, output='build/../'//path)
        call t%ok('input-that-is-the-output-is-refused', says(error, path//': is the input, it cannot be'))
        call read_init_file(path, 0, values, error, output=path//'.part')
        call t%ok('input-that-is-not-the-output-is-read', .not. allocated(error))
        call write_text('1 2 3 4 0 0 0 1 0 0 0 1 0 0 0 2')
        call read_init_file(path, 0, values, error)
        call t%close_to('refused-file-leaves-the-defaults', [values%h, values%moments, values%t_final], &
                        [0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp], 0.0_wp)
        call t%close_suite()
    end subroutine test_refused_text

    !> Invalid numbers.
    subroutine test_refused_values(t)
        type(tally), intent(inout) :: t
        character(*), parameter :: rest = ' 0 0 0 1 0 0 0 1 1 1 0', scheme_a = '0 0 0 0 0 0 0 1 ', &
            scheme_b = '0 0 0 0 0 0 0.5 '

        call t%open_suite('files-refused-values', 24)
        call refuse(t, 'zero-step-is-refused', 0, '0', 'h: expected a step that is not zero, found zero')
        call refuse(t, 'vanishing-step-is-refused', 2, '1e-999', 'h: expected a step that is not zero')
        call refuse(t, 'zero-step-of-a-run-is-refused', 4, '-0.0 1'//rest, &
                    'h: expected a step that is not zero')
        call refuse(t, 'run-of-no-length-is-refused', 4, '0.1 0'//rest, 'Tfin: expected Tfin/h')
        call refuse(t, 'step-against-the-run-is-refused', 4, '0.1 -1'//rest, 'Tfin: expected Tfin/h')
        call refuse(t, 'backward-step-of-a-forward-run-is-refused', 4, '-0.1 1'//rest, &
                    'Tfin: expected Tfin/h')
        call refuse(t, 'step-beyond-the-run-is-refused', 4, '1.1 1'//rest, 'Tfin: expected Tfin/h')
        call refuse(t, 'too-many-steps-are-refused', 4, '1e-10 1'//rest, &
                    'Tfin: expected Tfin/h to be from 1 to 2e9')
        call refuse(t, 'far-too-many-steps-are-refused', 4, '1e-300 1e100'//rest, 'Tfin: expected Tfin/h')
        call refuse(t, 'zero-moment-is-refused', 0, '1'//nl//'1 0 1', &
                    'line 2: I(2): expected a positive moment')
        call refuse(t, 'negative-moment-is-refused', 0, '1 1 1 -2', &
                    'I(3): expected a positive moment of inertia, found -2.0')
        call refuse(t, 'vanishing-moment-is-refused', 4, '1 1 0 0 0 1 0 0 0 1e-320 1 1 0', &
                    'I(1): expected a positive')
        call refuse(t, 'zero-matrix-is-refused', 0, '1 1 1 1 0 0 0 0 0 0 0 0 0 0 0 0', &
                    'Q: expected an orthogonal')
        call refuse(t, 'stretched-matrix-is-refused', 0, '1 1 1 1 0 0 0 1 0 0 0 1 0 0 0 1.00001', &
                    'Q: expected an orthogonal')
        call refuse(t, 'sheared-matrix-is-refused', 0, '1 1 1 1 0 0 0 1 0 0 0.001 1 0 0 0 1', &
                    'Q: expected an orthogonal')
        call refuse(t, 'huge-matrix-is-refused', 0, '1 1 1 1 0 0 0 1 0 0 1e100 1 0 0 0 1', &
                    'Q: expected an orthogonal')
        call refuse(t, 'reflection-is-refused', 0, '1 1 1 1 0 0 0 1 0 0 0 0 1 0 1 0', &
                    'Q: expected a rotation')
        call refuse(t, 'zero-quaternion-is-refused', 2, '1 1 1 1 0 0 0'//nl//'0 0 -0.0 0', &
                    'line 2: q: expected a quaternion that is not zero')
        call refuse(t, 'negative-points-are-refused', 4, '1 1 0 0 0 1 0 0 0 1 1 1 -1', &
                    'np: expected a whole number')
        call refuse(t, 'half-a-point-is-refused', 4, '1 1 0 0 0 1 0 0 0 1 1 1 2.5', &
                    'np: expected a whole number')
        call refuse(t, 'too-many-points-are-refused', 3, '1 1 0 0 0'//nl//identity//'1 1 1 1e30', &
                    'line 3: np: expected a whole number from 0 to 1000')
        call refuse(t, 'drift-coefficients-that-miss-one-are-refused', 1, '0 0 0 0 0 0 0 1.1', &
                    'a: expected 2 (a1 + ... + a7) + a8 = 1, found 1.1')
        call refuse(t, 'kick-coefficients-that-miss-one-are-refused', 1, scheme_a//'0 0 0 0 0 0 1', &
                    'b: expected 2 (b1 + ... + b7) = 1')
        call refuse(t, 'example-1-checks-its-moments-too', 1, scheme_a//scheme_b//'1 1 0 0 0 '//identity// &
                    '1 1 0', &
                    'I(3): expected a positive')
        call t%close_suite()
    end subroutine test_refused_values

    !> N = int(Tfin/h), whole quotients recognised through rounding.
    subroutine test_steps(t)
        type(tally), intent(inout) :: t
        integer :: i
        logical :: whole

        call t%open_suite('files-steps', 9)
        call t%equal('steps-of-a-whole-quotient', whole_steps(5.0e4_wp, 0.5_wp), 100000)
        call t%equal('steps-are-cut-to-a-whole-number', whole_steps(10.0_wp, 3.0_wp), 3)
        call t%equal('quotient-short-by-rounding-is-whole', whole_steps(0.3_wp, 0.1_wp), 3)
        call t%equal('quotient-short-by-the-digits-of-a-file-is-whole', whole_steps(1.0_wp, &
                    0.3333333334_wp), 3)
        call t%equal('quotient-that-is-clearly-short-is-cut', whole_steps(99.9999_wp, 1.0_wp), 99)
        whole = .true.
        do i = 1, 2000
            whole = whole .and. whole_steps(i*0.1_wp, 0.1_wp) == i .and. whole_steps(real(i, wp), &
                        1.0_wp/i) == i*i
        end do
        call t%ok('decimal-steps-never-lose-one', whole)
        call t%equal('steps-of-a-backward-run', whole_steps(-7.0_wp, -2.0_wp), 3)
        call t%equal('no-steps-in-the-wrong-direction', whole_steps(7.0_wp, -2.0_wp), 0)
        call t%equal('most-steps', whole_steps(1.9e9_wp, 1.0_wp), 1900000000)
        call t%close_suite()
    end subroutine test_steps

    !> A file with this content is refused with a message that contains `part`.
    subroutine refuse(t, name, example, content, part)
        type(tally), intent(inout) :: t
        character(*), intent(in) :: name, content, part
        integer, intent(in) :: example
        type(init_values) :: values
        character(:), allocatable :: error

        call write_text(content)
        call read_init_file(path, example, values, error)
        call t%ok(name, says(error, part))
    end subroutine refuse

end module frb_test_files
