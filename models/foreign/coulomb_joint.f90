! The law of models/coulomb_joint in Fortran; its LAW.md has the equations.
module coulomb_joint
  use pilum
  implicit none

  integer, parameter :: PLASTIC_SLIP = 1, PLASTIC_OPENING = 2, GAP = 3, BROKEN = 4, N_STATES = 4

contains

  subroutine describe()
    call describe_law(id='coulomb_joint_fortran', name='Coulomb joint in Fortran', &
      version='0.1.0', author='The Pilum authors', licence='MIT OR Apache-2.0', &
      doc='Linear elasticity, Coulomb friction with constant dilatancy, brittle tensile '// &
      'strength and separation.', references='De Gennaro & Frank, Table IV (2)', &
      prepare=prepare, update=update)
    call add_parameter('normal_stiffness', 'K_n', 'kPa/m', 'Normal stiffness.', &
      above=0.0_dp, usual=[1e3_dp, 1e12_dp])
    call add_parameter('shear_stiffness', 'K_t', 'kPa/m', 'Shear stiffness.', &
      above=0.0_dp, usual=[1e3_dp, 1e12_dp])
    call add_parameter('cohesion', 'c', 'kPa', 'Cohesion, until the joint has opened.', &
      lower=0.0_dp, usual=[0.0_dp, 1e3_dp])
    call add_parameter('friction_angle', 'phi', 'deg', 'Friction angle.', &
      lower=0.0_dp, below=90.0_dp, usual=[0.0_dp, 50.0_dp])
    call add_parameter('dilatancy_angle', 'psi', 'deg', 'Dilatancy angle.', &
      lower=0.0_dp, below=90.0_dp, usual=[0.0_dp, 30.0_dp])
    call add_parameter('tensile_strength', 'R_t', 'kPa', &
      'Tensile strength, until the joint has opened.', &
      lower=0.0_dp, usual=[0.0_dp, 1e3_dp], default=0.0_dp)
    call add_state(PLASTIC_SLIP, 'plastic_slip', 'xi', 'm', &
      'Plastic slip, accumulated over both directions.')
    call add_state(PLASTIC_OPENING, 'plastic_opening', '[u_n^p]', 'm', &
      'Plastic opening by dilatancy.')
    call add_state(GAP, 'gap', 'g', 'm', &
      'Opening beyond the position of contact without stress; 0 in contact.')
    call add_state(BROKEN, 'broken', 'b', '-', &
      '1 once the joint has opened, which breaks its bond; 0 before.')
    call add_formulation(PILUM_H_INTERFACE_2D, N_STATES)
  end subroutine

  ! K_n, K_t, c, tan phi, tan psi, R_t from there on.
  subroutine prepare(p, refusal)
    real(dp), intent(inout) :: p(:)
    character(len=*), intent(inout) :: refusal
    if (p(5) > p(4)) then
      refusal = 'dilatancy_angle: it is above friction_angle'
      return
    end if
    p(4:5) = tan(p(4:5)*acos(-1.0_dp)/180)
    if (p(6)*p(4) > p(3)*(1 + 1e-12_dp)) &
      refusal = 'tensile_strength: it is above cohesion / tan(friction_angle)'
  end subroutine

  subroutine update(p, point, tangent, end, status)
    real(dp), intent(in) :: p(:)
    type(point_type), intent(in) :: point
    integer, intent(in) :: tangent
    type(response_type), intent(inout) :: end
    integer(c_int32_t), intent(inout) :: status
    status = PILUM_OK
    call carry(p, point, end)
    if (tangent == TANGENT_ELASTIC) then
      end%tangent = 0
      end%tangent(1, 1) = p(1)
      end%tangent(2, 2) = p(2)
    end if
  end subroutine

  subroutine carry(p, point, end)
    real(dp), intent(in) :: p(:)
    type(point_type), intent(in) :: point
    type(response_type), intent(inout) :: end
    real(dp) :: k_n, k_t, cohesion, tan_phi, tan_psi, tensile, opening, slip, start(2), fraction
    real(dp) :: normal, shear, excess, round_off, resistance, d_lambda, of_sign
    real(dp) :: c(2, 2), by_normal, by_tangential
    logical :: opens
    k_n = p(1)
    k_t = p(2)
    tan_phi = p(4)
    tan_psi = p(5)
    cohesion = merge(0.0_dp, p(3), point%state(BROKEN) > 0.5_dp)
    tensile = merge(0.0_dp, p(6), point%state(BROKEN) > 0.5_dp)
    opening = point%increment(1)
    slip = point%increment(2)
    start = point%flux(1:2)
    ! d slip / d jump: slip before the contact re-forms does not act.
    by_normal = 0
    by_tangential = 1
    end%state(:N_STATES) = point%state(:N_STATES)
    if (point%state(GAP) > 0) then
      if (point%state(GAP) + opening >= 0) then
        call open_at(point%state(GAP) + opening, end)
        return
      end if
      ! Contact re-forms on the way; the path within the increment is straight.
      fraction = 1 + point%state(GAP)/opening
      by_normal = -slip*point%state(GAP)/opening**2
      by_tangential = fraction
      start = 0
      opening = opening + point%state(GAP)
      slip = slip*fraction
      cohesion = 0
      tensile = 0
    end if
    ! Eq. (1).
    normal = start(1) + k_n*opening
    shear = start(2) + k_t*slip
    c = 0
    c(1, 1) = k_n
    c(2, 2) = k_t
    ! Eq. (2).
    excess = abs(shear) + normal*tan_phi - cohesion
    round_off = 4*epsilon(1.0_dp)*(cohesion + abs(normal*tan_phi))
    if (excess > round_off .or. normal > tensile) then
      ! Eq. (4), (3).
      resistance = k_t + k_n*tan_phi*tan_psi
      d_lambda = max(excess, 0.0_dp)/resistance
      normal = normal - k_n*tan_psi*d_lambda
      opens = normal > tensile .or. cohesion - normal*tan_phi < 0
      if (opens) d_lambda = slip_before_opening()
      end%state(PLASTIC_SLIP) = end%state(PLASTIC_SLIP) + d_lambda
      end%state(PLASTIC_OPENING) = end%state(PLASTIC_OPENING) + tan_psi*d_lambda
      if (opens) then
        call open_at(max(start(1)/k_n + opening - tan_psi*d_lambda, 0.0_dp), end)
        return
      end if
      of_sign = sign(1.0_dp, shear)
      shear = of_sign*(cohesion - normal*tan_phi)
      ! Eq. (5).
      c(1, 1) = k_n*k_t/resistance
      c(1, 2) = -of_sign*c(1, 1)*tan_psi
      c(2, 1) = -of_sign*c(1, 1)*tan_phi
      c(2, 2) = c(1, 1)*tan_phi*tan_psi
    end if
    end%state(GAP) = 0
    end%flux(1:2) = [normal, shear]
    end%tangent(1:2, 1) = c(:, 1) + c(:, 2)*by_normal
    end%tangent(1:2, 2) = c(:, 2)*by_tangential

  contains

    ! Slip from the start of the increment to the moment when t_n reaches the tensile strength,
    ! Eq. (6): rates are constant before and after yielding.
    real(dp) function slip_before_opening()
      real(dp) :: opens_elastically, yields, growth, from, rate, at, slip_rate, opening_rate, left
      integer :: side
      opens_elastically = 0
      if (start(1) < tensile .and. opening > 0) opens_elastically = (tensile - start(1))/(k_n*opening)
      yields = huge(1.0_dp)
      growth = 0
      do side = 1, -1, -2
        from = side*start(2) + start(1)*tan_phi - cohesion
        rate = side*k_t*slip + k_n*opening*tan_phi
        at = 0
        if (from < 0 .and. rate > 0) at = -from/rate
        if (rate > 0 .and. at < yields) then
          yields = at
          growth = rate
        end if
      end do
      slip_before_opening = 0
      if (opens_elastically <= yields) return
      slip_rate = growth/(k_t + k_n*tan_phi*tan_psi)
      opening_rate = k_n*opening - k_n*tan_psi*slip_rate
      left = tensile - start(1) - yields*k_n*opening
      if (opening_rate > 0 .and. left > 0) slip_before_opening = slip_rate*left/opening_rate
    end function
  end subroutine

  ! The joint is open at the end: no traction, no stiffness.
  subroutine open_at(wide, end)
    real(dp), intent(in) :: wide
    type(response_type), intent(inout) :: end
    end%state(GAP) = wide
    end%state(BROKEN) = 1
  end subroutine
end module

function pilum_entry(host) result(library) bind(C, name='pilum_entry')
  use coulomb_joint
  implicit none
  type(c_ptr), value :: host
  type(c_ptr) :: library
  if (.not. described()) call describe()
  library = the_library()
end function
